#include "services/server/daemon/program/daemon.h"

#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "base/host_clock.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/holder_record.h"
#include "services/ground/confinement/confinement.h"
#include "services/ground/confinement/worker_user.h"
#include "services/server/catalogue/catalogue.h"
#include "services/server/catalogue/folder_sync.h"
#include "services/server/daemon/calls/path_policy.h"
#include "services/server/daemon/door/call_observer.h"
#include "services/server/daemon/program/daemon_parts.h"
#include "services/server/daemon/program/reader_process.h"
#include "services/server/daemon/program/server_service.h"
#include "services/server/daemon/studio/camera_service.h"
#include "services/server/daemon/studio/session_service.h"
#include "services/server/daemon/studio/take_folder.h"
#include "services/server/daemon/studio/take_service.h"
#include "services/server/daemon/work/cores.h"
#include "services/server/daemon/work/job_service.h"
#include "services/server/daemon/work/library_service.h"
#include "services/server/daemon/work/lost_jobs.h"
#include "services/server/daemon/work/operation_service.h"
#include "services/server/daemon/work/take_input.h"
#include "services/server/notice/end_notices.h"
#include "services/server/rpc/error_detail.h"
#include "services/studio/recorder/recorder_process.h"
#include "services/work/executor/local_executor.h"
#include "services/work/executor/process_record.h"
#include "services/work/items/item_words.h"
#include "services/work/slurm/slurm_executor.h"
#include "services/work/spec/job_input.h"

namespace weft {
namespace {

constexpr int kMaxWorkers = 1024;

std::string ProcessFolderOf(const std::string& state_folder) {
  return absl::StrCat(state_folder, "/processes");
}

// Waits for the end of processes that an earlier daemon left behind.
absl::Status AwaitEarlierProcesses(const std::string& state_folder) {
  constexpr std::chrono::seconds kOldWorkersTimeout{10};  // the kernel ends them with their daemon
  constexpr std::chrono::milliseconds kLook{5};
  const auto until = std::chrono::steady_clock::now() + kOldWorkersTimeout;
  for (;;) {
    const std::vector<pid_t> running = FindRecorded(ProcessFolderOf(state_folder));
    if (running.empty()) break;
    if (std::chrono::steady_clock::now() > until) {
      return absl::FailedPreconditionError(absl::StrCat(
          state_folder, ": processes of a weftd that has ended still run: ", absl::StrJoin(running, ", "),
          "; end them, or wait for their end"));
    }
    std::this_thread::sleep_for(kLook);
  }
  // Earlier versions left a lock with their processes.
  const std::string path = ProcessFolderOf(state_folder);
  const absl::Status taken = FileLock::Take(path, kOldWorkersTimeout).status();
  if (!absl::IsFailedPrecondition(taken)) return taken;
  return absl::FailedPreconditionError(absl::StrCat(
      path, ".lock: processes of a weftd that has ended still run; `fuser ", path, ".lock` names them"));
}

// Whether an unfinished job or operation reads a folder.
std::function<bool(const std::string&)> IsReadBy(const Daemon::Parts& parts) {
  return [&parts](const std::string& folder) {
    const std::vector<v1::Job> jobs = parts.queue->Unfinished();
    return std::ranges::any_of(jobs, [&](const v1::Job& job) { return IsReadFrom(job.spec(), folder); }) ||
           (parts.operation_queue && parts.operation_queue->Reads(folder));
  };
}

absl::StatusOr<std::unique_ptr<Executor>> MakeLocalExecutor(const DaemonOptions& options,
                                                            const CoreShare& share) {
  LocalExecutorOptions executor_options;
  executor_options.worker_program = options.worker_program;
  executor_options.task_folder = absl::StrCat(options.state_folder, "/tasks");
  executor_options.workers = share.workers;
  executor_options.worker_memory_mib = options.worker_memory_mib == 0
                                           ? ShareMemoryMib(UsableMemoryMib(), share.workers)
                                           : std::max<int64_t>(0, options.worker_memory_mib);
  executor_options.process_folder = ProcessFolderOf(options.state_folder);
  executor_options.worker_user = options.worker_user;
  executor_options.allowed_paths = options.allow_paths;
  executor_options.state_folder = options.state_folder;
  executor_options.stop_grace = options.stop_grace;
  executor_options.silence_limit = options.silence_limit;
  // What a daemon that was killed left there; the catalogue is ours by now. A full disk may not give the
  // folder again.
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(executor_options.task_folder, ignored)) {
    std::filesystem::remove_all(entry.path(), ignored);
  }
  return LocalExecutor::Create(executor_options);
}

// Makes the folder, closed to others. `options` gets the paths as the file system has them.
absl::StatusOr<PathPolicy> TakeStateFolder(DaemonOptions& options) {
  WEFT_RETURN_IF_ERROR(CreateFolders(options.state_folder));
  options.state_folder = std::filesystem::canonical(options.state_folder).string();
  WEFT_ASSIGN_OR_RETURN(PathPolicy policy, PathPolicy::Create(options.allow_paths, options.state_folder));
  options.allow_paths = policy.allowed();
  // Takes, results and the list of clients are nobody else's.
  std::error_code error;
  std::filesystem::permissions(options.state_folder, std::filesystem::perms::owner_all, error);
  if (error) return WriteError(options.state_folder, error.value());
  return policy;
}

v1::ServerInfo InfoOf(const DaemonOptions& options, const PathPolicy& policy, const CoreShare& share) {
  v1::ServerInfo info;
  info.set_version(WEFT_VERSION);
  info.set_workers(share.workers);
  info.set_threads_per_worker(share.threads_per_worker);
  info.mutable_allowed_paths()->Assign(policy.allowed().begin(), policy.allowed().end());
  info.set_state_folder(options.state_folder);
  info.set_started_unix_ns(HostTime_ns());
  return info;
}

SlurmOptions SlurmOptionsOf(const DaemonOptions& options) {
  SlurmOptions slurm = options.slurm;
  if (slurm.worker_program.empty()) slurm.worker_program = options.worker_program;
  slurm.allowed_paths = options.allow_paths;
  slurm.state_folder = options.state_folder;
  return slurm;
}

absl::StatusOr<std::unique_ptr<Executor>> MakeExecutor(const DaemonOptions& options, const CoreShare& share) {
  if (options.slurm.folder.empty()) return MakeLocalExecutor(options, share);
  return SlurmExecutor::Create(SlurmOptionsOf(options));
}

// Another daemon serves the state folder by now, so whatever this one writes damages it.
void EndAtOnce() {
  spdlog::critical(
      "another weftd took the state folder while this one stood still for more than {} s; it ends without "
      "writing anything",
      HolderRecord::kStale.count());
  spdlog::default_logger()->flush();
  std::_Exit(EXIT_FAILURE);
}

// Begins with the end of an earlier daemon's processes, and the notices.
absl::StatusOr<std::unique_ptr<JobQueue>> MakeQueue(const DaemonOptions& options, const CoreShare& share,
                                                    Daemon::Parts& parts) {
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<Catalogue> catalogue,
                        Catalogue::Open(absl::StrCat(options.state_folder, "/catalogue.sqlite"), EndAtOnce));
  WEFT_RETURN_IF_ERROR(AwaitEarlierProcesses(options.state_folder));
  WEFT_ASSIGN_OR_RETURN(parts.notices,
                        EndNotices::Open(absl::StrCat(options.state_folder, "/notices"), options.notices));
  for (const std::string& warning : catalogue->warnings()) spdlog::warn("{}", warning);
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<Executor> executor, MakeExecutor(options, share));
  JobQueueOptions queue_options;
  queue_options.threads_per_worker =
      options.slurm.folder.empty() ? share.threads_per_worker : options.slurm.cpus_per_task;
  queue_options.find_incomplete = options.find_incomplete;
  queue_options.is_settled = [](const std::string& dump) {
    return IsSettled(std::filesystem::path(dump).parent_path().string());
  };
  queue_options.endings = options.endings;
  queue_options.max_of_one_caller = options.caller_limits.jobs;
  queue_options.admit = [&parts] { return parts.drain->Admit(); };
  queue_options.on_end = [&parts](const v1::Job& job) { return parts.notices->JobEnded(job); };
  queue_options.results_folder = absl::StrCat(options.state_folder, "/results");
  queue_options.is_read = IsReadBy(parts);
  queue_options.warnings = TakeUpLostJobs(queue_options.results_folder, *catalogue);
  for (const std::string& warning : queue_options.warnings) spdlog::warn("{}", warning);
  return JobQueue::Create(std::move(catalogue), std::move(executor), std::move(queue_options));
}

}  // namespace

TakeStoreOptions Daemon::TakeKeepingOf(const DaemonOptions& options, const PathPolicy& policy,
                                       const Parts& parts) {
  TakeStoreOptions keeping;
  keeping.takes_folder = absl::StrCat(options.state_folder, "/takes");
  keeping.trash_folder = absl::StrCat(options.state_folder, "/trash");
  keeping.looks_folder = absl::StrCat(options.state_folder, "/looks");
  keeping.recorder_program = options.recorder_program;
  keeping.resolve_take = [resolve = InputsOf(options, policy, parts)](const std::string& field,
                                                                      const std::string& take) {
    return resolve(field, v1::ITEM_KIND_DUMP, take);
  };
  keeping.admit = [&parts] { return parts.drain->Admit(); };
  keeping.on_end = [&parts](const v1::RecordedTake& take) { return parts.notices->TakeEnded(take); };
  keeping.is_read = IsReadBy(parts);
  return keeping;
}

ResolveInput Daemon::InputsOf(const DaemonOptions& options, const PathPolicy& policy, const Parts& parts) {
  return [&parts, policy, takes_folder = absl::StrCat(options.state_folder, "/takes")](
             const std::string& field, v1::ItemKind kind,
             const std::string& value) -> absl::StatusOr<std::string> {
    absl::string_view id = value;
    if (absl::ConsumePrefix(&id, kJobPrefix)) {
      WEFT_ASSIGN_OR_RETURN(const v1::Job job, parts.queue->Get(std::string(id)));
      if (job.state() == v1::JOB_STATE_QUEUED && job.frames().done() + job.frames().degraded() == 0)
        return FieldError(absl::StatusCode::kFailedPrecondition,
                          {field, absl::StrCat(value, ": is queued, so it has no results yet"),
                           absl::StrCat("wait for its end, `weft job watch ", std::string(id), "`")});
      return job.spec().out();
    }
    if (absl::StartsWith(value, kLibraryPrefix)) {
      WEFT_ASSIGN_OR_RETURN(
          HeldItem item, Naming(field, parts.library->Hold(kind, value.substr(sizeof(kLibraryPrefix) - 1))));
      return std::move(item.path);
    }
    WEFT_ASSIGN_OR_RETURN(std::string take, TakeOfName(takes_folder, value));
    if (take == value) return policy.CheckInput(field, value);
    if (TakeExists(take)) return take;
    return FieldError(absl::StatusCode::kNotFound,
                      {field, absl::StrCat(value, ": no such take"), "`weft take list` shows the takes"});
  };
}

OperationQueueOptions Daemon::OperationsOf(const DaemonOptions& options, const PathPolicy& policy,
                                           const Parts& parts) {
  OperationQueueOptions operations;
  operations.folder = absl::StrCat(options.state_folder, "/operations");
  operations.program = options.command_program;
  operations.admit = [&parts] { return parts.drain->Admit(); };
  operations.adopt_take = [&parts](const std::string& take_folder, const std::string& id) {
    return parts.take_store->Adopt(take_folder, id, absl::StrCat("made by operation ", id));
  };
  operations.take_exists = [state = options.state_folder](const std::string& id) {
    return TakeExists(absl::StrCat(state, "/takes/", id)) || TakeExists(absl::StrCat(state, "/trash/", id));
  };
  operations.resolve = InputsOf(options, policy, parts);
  operations.links = policy.links();
  operations.readable_besides = [policy, state = options.state_folder] {
    std::vector<std::string> readable = policy.AllowedButState();
    for (const char* folder : {"/takes", "/results", "/library"}) readable.push_back(state + folder);
    return readable;
  };
  operations.process_folder = ProcessFolderOf(options.state_folder);
  if (options.worker_memory_mib >= 0) operations.memory_mib = ShareMemoryMib(UsableMemoryMib(), 2);
  return operations;
}

absl::Status DaemonOptions::Validate() const {
  if (state_folder.empty())
    return absl::InvalidArgumentError(
        "--state: must not be empty; give a folder, here or as `state` in the file of --config");
  std::vector<std::pair<const char*, std::string>> addresses;
  for (const std::string& text : listen) addresses.emplace_back("--listen", text);
  if (!metrics_listen.empty()) addresses.emplace_back("--metrics", metrics_listen);
  for (const auto& [option, text] : addresses) {
    WEFT_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(text));
    if (address.kind != ListenKind::kNetwork) continue;
    if (tls.certificate.empty() || tls.key.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat(option, ": ", text,
                       " can be reached from other machines, which needs TLS; give --tls-cert and "
                       "--tls-key, or listen on 127.0.0.1"));
    }
    WEFT_RETURN_IF_ERROR(CheckTlsFiles(tls));
  }
  if (workers < 0 || workers > kMaxWorkers) {
    return absl::InvalidArgumentError(absl::StrCat("--workers: ", workers, ", must be 0 to ", kMaxWorkers));
  }
  if (threads_per_worker < 0 || threads_per_worker > kMaxWorkers) {
    return absl::InvalidArgumentError(
        absl::StrCat("--threads-per-worker: ", threads_per_worker, ", must be 0 to ", kMaxWorkers));
  }
  WEFT_RETURN_IF_ERROR(notices.Validate());
  if (!slurm.folder.empty()) {
    WEFT_RETURN_IF_ERROR(SlurmOptionsOf(*this).Validate());
    if (!worker_user.empty()) {
      return absl::InvalidArgumentError(
          "--worker-user: tasks on a cluster run as the daemon's user; leave it out beside --slurm-folder");
    }
  }
  return worker_user.empty() ? absl::OkStatus() : CheckWorkerUser(worker_user);
}

Daemon::Daemon() : parts_(std::make_unique<Parts>()) {}

Daemon::~Daemon() { Stop(); }

absl::StatusOr<std::unique_ptr<Daemon>> Daemon::Start(DaemonOptions options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(PathPolicy policy, TakeStateFolder(options));
  if (const std::string gaps = ConfinementGaps(); !gaps.empty()) spdlog::warn("{}", gaps);
  if (options.reads_in_processes) ReadInProcesses(options);
  std::unique_ptr<Daemon> daemon(new Daemon());
  const CoreShare share = ShareCores(UsableCores(), options.workers, options.threads_per_worker);
  daemon->workers_ = share.workers;
  daemon->threads_per_worker_ = share.threads_per_worker;
  daemon->parts_->drain = std::make_unique<Drain>(options.on_drained);
  WEFT_ASSIGN_OR_RETURN(daemon->parts_->queue, MakeQueue(options, share, *daemon->parts_));
  WEFT_ASSIGN_OR_RETURN(daemon->parts_->library, Library::Open(options.state_folder));

  const v1::ServerInfo info = InfoOf(options, policy, share);
  Parts& parts = *daemon->parts_;
  WEFT_ASSIGN_OR_RETURN(parts.session_registry,
                        SessionRegistry::Create(absl::StrCat(options.state_folder, "/sessions")));
  parts.take_store = std::make_unique<TakeStore>(TakeKeepingOf(options, policy, parts));
  WEFT_ASSIGN_OR_RETURN(parts.operation_queue, OperationQueue::Create(OperationsOf(options, policy, parts)));
  parts.take_store->Begin();
  const FindCaller caller = [&parts](const grpc::ServerContextBase& context) {
    return CallerOf(context, *parts.access);
  };
  WEFT_RETURN_IF_ERROR(daemon->KnowCallers(options));
  parts.uploads = std::make_unique<Uploads>(*parts.library, options.state_folder, options.check_item);
  ResolveInput resolve = InputsOf(options, policy, parts);
  const auto rehearse = [&parts](const v1::RehearseRetentionRequest& request) {
    return parts.retention->Rehearse(request.rules(), request.ahead_days());
  };
  auto& services = parts.services;
  services.push_back(MakeOperationService(*parts.operation_queue, caller));
  services.push_back(MakeCameraService(*parts.take_store, *parts.session_registry));
  services.push_back(
      MakeSessionService(*parts.session_registry, *parts.take_store, *parts.library, policy, caller));
  services.push_back(MakeTakeService(*parts.take_store, *parts.session_registry, *parts.queue, caller));
  services.push_back(
      MakeJobService({*parts.queue, *parts.library, std::move(policy), std::move(resolve),
                      absl::StrCat(options.state_folder, "/results"), options.load_inputs, caller}));
  services.push_back(MakeServerService(*parts.queue, *parts.drain, info, rehearse));
  services.push_back(
      MakeLibraryService(*parts.queue, *parts.operation_queue, *parts.library, *parts.uploads, caller));
  daemon->BeginRetention(options);
  WEFT_RETURN_IF_ERROR(daemon->Listen(options));
  return daemon;
}

void Daemon::SetNotices(const NoticeOptions& notices) { parts_->notices->SetOptions(notices); }

void Daemon::Stop() {
  std::call_once(parts_->stopped, [this] {
    parts_->retention.reset();
    parts_->console.reset();
    if (parts_->connections) parts_->connections->Stop();
    parts_->metrics_page.reset();
    parts_->health.reset();
    if (parts_->server) parts_->server->GetHealthCheckService()->Shutdown();
    if (parts_->drain) parts_->drain->Stop();
    if (parts_->queue) parts_->queue->Stop();
    if (parts_->take_store) parts_->take_store->Stop();
    if (parts_->operation_queue) parts_->operation_queue->Stop();
    if (parts_->server) {
      constexpr std::chrono::seconds kGrace{2};
      parts_->server->Shutdown(std::chrono::system_clock::now() + kGrace);
      parts_->server->Wait();
      parts_->poller.reset();
    }
  });
}

}  // namespace weft
