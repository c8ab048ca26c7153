#include "services/server/daemon/work/operation_queue.h"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/no_threads.h"
#include "services/work/executor/child_process.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostOutputBytes = size_t{1} << 20;
constexpr int kMostNotes = 100;
constexpr size_t kLongestNote_bytes = 8192;
constexpr int kMostCrashes = 2;

// "weft: progress: STEP: DONE of TOTAL", as main.cpp of `weft` prints it for a program that watches.
bool IsProgress(absl::string_view line, std::string& step, double& share) {
  if (!absl::ConsumePrefix(&line, "weft: progress: ")) return false;
  const std::vector<std::string> parts = absl::StrSplit(line, ": ");
  const std::vector<std::string> numbers = absl::StrSplit(parts.back(), " of ");
  double done = 0, total = 0;
  if (parts.size() != 2 || numbers.size() != 2 || !absl::SimpleAtod(numbers[0], &done) ||
      !absl::SimpleAtod(numbers[1], &total)) {
    return true;
  }
  step = parts[0];
  share = total > 0 ? std::clamp(done / total, 0.0, 1.0) : 0;
  return true;
}

}  // namespace

bool HasEnded(const v1::Operation& operation) {
  return operation.state() != v1::JOB_STATE_QUEUED && operation.state() != v1::JOB_STATE_RUNNING;
}

// How the process of an operation ended.
struct OperationQueue::Outcome {
  std::optional<int> exit_status;  // none: a signal ended it, `error` says which
  std::string output;
  std::vector<std::string> notes;
  std::string error;
  bool refused = false;  // this machine had no room for it
  bool stopped = false;  // by the daemon's own end
};

absl::StatusOr<std::unique_ptr<OperationQueue>> OperationQueue::Create(OperationQueueOptions options) {
  WEFT_RETURN_IF_ERROR(CreateFolders(options.folder));
  std::unique_ptr<OperationQueue> queue(new OperationQueue(std::move(options)));
  queue->Load();
  queue->worker_ = std::jthread([queue = queue.get()](const std::stop_token& stop) { queue->Work(stop); });
  return queue;
}

OperationQueue::~OperationQueue() { Stop(); }

void OperationQueue::Stop() {
  worker_.request_stop();
  if (worker_.joinable()) worker_.join();
}

void OperationQueue::Load() {
  const Lock lock(mutex_);
  std::error_code error;
  for (const fs::directory_entry& folder : fs::directory_iterator(options_.folder, error)) {
    const std::string id = folder.path().filename();
    std::error_code fault;
    if (!fs::exists(FileOf(id), fault) && !fault) {
      RemoveTree(folder.path());  // not acknowledged yet, or forgotten
      continue;
    }
    Entry entry;
    absl::Status status = ReadJsonFile(FileOf(id), entry.operation);
    if (status.ok()) status = CheckOperationSpec(entry.operation.spec());
    if (status.ok() && entry.operation.id() != id) {
      status = absl::DataLossError(
          absl::StrCat(FileOf(id), ": is operation \"", entry.operation.id(), "\"; remove the folder"));
    }
    if (!status.ok()) {
      warnings_.push_back(EscapedText(std::string(status.message())));
      spdlog::warn("{}", warnings_.back());
      continue;
    }
    if (HasEnded(entry.operation)) {
      Shorten(entry);
    } else {
      entry.operation.set_state(v1::JOB_STATE_QUEUED);
      auto command = CommandOf(entry.operation.spec(), options_.resolve);
      if (command.ok()) entry.inputs = std::move(command->inputs);  // else its run says what is missing
    }
    entries_[id] = std::move(entry);
  }
}

bool OperationQueue::IsCancelled(const std::string& id) {
  const Lock lock(mutex_);
  const auto found = entries_.find(id);
  return found == entries_.end() || found->second.cancelled;
}

OperationQueue::Entry* OperationQueue::Next() {
  std::map<std::pair<int64_t, std::string>, Entry*> waiting;  // oldest first; ids may be keys
  for (auto& [id, entry] : entries_) {
    if (entry.operation.state() == v1::JOB_STATE_QUEUED)
      waiting[{entry.operation.created_unix_ns(), id}] = &entry;
  }
  if (waiting.empty()) return nullptr;
  std::vector<std::string> callers;
  for (const auto& [age, entry] : waiting) callers.push_back(entry->operation.started_by());
  return std::next(waiting.begin(), static_cast<std::ptrdiff_t>(turns_.Next(callers)))->second;
}

void OperationQueue::Work(const std::stop_token& stop) {
  Lock lock(mutex_);
  while (!stop.stop_requested()) {
    Entry* next = Next();
    if (next == nullptr) {
      changed_.wait(lock, stop, [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return Next() != nullptr; });
      continue;
    }
    const std::string id = next->operation.id();
    next->operation.set_state(v1::JOB_STATE_RUNNING);
    next->operation.set_started_unix_ns(HostTime_ns());
    WriteUntilItSucceeds(lock, id, stop);
    if (stop.stop_requested()) return;
    const v1::Operation operation = entries_.at(id).operation;
    spdlog::info("operation {}: {}", id, operation.spec().command());
    turns_.Begin(operation.started_by());
    lock.unlock();
    const auto began = std::chrono::steady_clock::now();
    const Outcome outcome = Run(operation, stop);
    lock.lock();
    turns_.End(operation.started_by(),
               std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
    if (outcome.stopped) return;
    Conclude(entries_.at(id), outcome);
    if (outcome.refused)
      changed_.wait_for(lock, stop, std::chrono::seconds(2), [] { return false; });
    else
      WriteUntilItSucceeds(lock, id, stop);
  }
}

// A disk that is full or faulty delays the state, and loses nothing: the operation would begin anew.
void OperationQueue::WriteUntilItSucceeds(Lock& lock, const std::string& id, const std::stop_token& stop) {
  constexpr std::chrono::seconds kPause{2};
  for (bool is_told = false; !stop.stop_requested(); is_told = true) {
    const auto found = entries_.find(id);
    if (found == entries_.end()) return;  // it ended, and was deleted meanwhile
    const absl::Status status = Write(found->second.operation);
    if (status.ok() && HasEnded(found->second.operation)) Shorten(found->second);
    if (status.ok()) return;
    if (!is_told) spdlog::warn("operation {}: {}", id, EscapedText(std::string(status.message())));
    changed_.wait_for(lock, stop, kPause, [] { return false; });
  }
}

void OperationQueue::NoteProgress(const std::string& id, const std::string& step, double share) {
  const Lock lock(mutex_);
  entries_.at(id).operation.set_step(step);
  entries_.at(id).operation.set_share_done(share);
}

absl::StatusOr<ChildProcess> OperationQueue::StartProcess(const v1::Operation& operation, Outcome& outcome) {
  const std::string& id = operation.id();
  const absl::StatusOr<OperationCommand> command = CommandOf(operation.spec(), options_.resolve);
  RemoveTree(OutOf(id));
  absl::Status ready = command.ok() ? CreateFolders(OutOf(id)) : command.status();
  if (!ready.ok()) {
    outcome.refused = command.ok();
    if (!command.ok()) outcome.exit_status = ExitStatusOf(ready);
    outcome.error = std::string(ready.message());
    return ready;
  }
  {
    const Lock lock(mutex_);
    entries_.at(id).inputs = command->inputs;
  }
  std::vector<std::string> words = {absl::StrCat("--watched-by=", getpid()),
                                    absl::StrCat("--memory-mib=", options_.memory_mib)};
  const auto may_read = [&words](const std::vector<std::string>& paths) {
    for (const std::string& path : paths) words.push_back(absl::StrCat("--may-read=", path));
  };
  may_read(command->inputs);
  may_read(FindLinks(command->inputs, options_.links).others);
  if (FindOperationKind(operation.spec().command())->reads_besides() && options_.readable_besides)
    may_read(options_.readable_besides());
  words.insert(words.end(), command->arguments.begin(), command->arguments.end());
  absl::StatusOr<ChildProcess> child = ChildProcess::Spawn(
      options_.program, words,
      {.folder = OutOf(id), .record_folder = options_.process_folder, .hides_secrets = true});
  if (!child.ok()) {
    outcome.refused = absl::IsResourceExhausted(child.status());
    if (!outcome.refused) outcome.exit_status = kExitFailed;
    outcome.error = std::string(child.status().message());
  }
  return child;
}

int OperationQueue::AwaitProcess(const std::string& id, ChildProcess& child, const std::stop_token& stop,
                                 Outcome& outcome) {
  LineSplitter lines;
  const auto listen = [&] {
    outcome.output += child.ReadOut();
    outcome.output.resize(std::min(outcome.output.size(), kMostOutputBytes));
    for (const std::string& line : lines.Add(child.ReadErr())) {
      std::string step;
      double share = 0;
      absl::string_view words_of_line = line;
      if (IsProgress(line, step, share)) {
        if (!step.empty()) NoteProgress(id, step, share);
      } else if (absl::ConsumePrefix(&words_of_line, "weft: error: ")) {
        outcome.error = std::string(words_of_line.substr(0, kLongestNote_bytes));
      } else if (outcome.notes.size() < kMostNotes) {
        absl::ConsumePrefix(&words_of_line, "weft: warning: ");
        outcome.notes.emplace_back(words_of_line.substr(0, kLongestNote_bytes));
      }
    }
  };
  constexpr int kLook_ms = 200;
  constexpr int kGrace = 25;  // looks between SIGTERM and SIGKILL
  for (int asked = 0;;) {
    pollfd waits[] = {{child.exit_fd(), POLLIN, 0}, {child.out_fd(), POLLIN, 0}, {child.err_fd(), POLLIN, 0}};
    poll(waits, std::size(waits), kLook_ms);
    listen();
    if (waits[0].revents != 0) break;
    outcome.stopped = stop.stop_requested();
    if (!outcome.stopped && !IsCancelled(id)) continue;
    if (asked == 0) child.Signal(SIGTERM);
    if (++asked > kGrace) child.Signal(SIGKILL);
  }
  const int status = child.Reap();
  listen();
  return status;
}

OperationQueue::Outcome OperationQueue::Run(const v1::Operation& operation, const std::stop_token& stop) {
  Outcome outcome;
  absl::StatusOr<ChildProcess> child = StartProcess(operation, outcome);
  if (!child.ok()) return outcome;
  const int status = AwaitProcess(operation.id(), *child, stop, outcome);
  const bool lacks_threads =
      IsLackOfThreads(absl::StrCat(outcome.error, "\n", absl::StrJoin(outcome.notes, "\n")));
  if (WIFEXITED(status))
    outcome.exit_status = WEXITSTATUS(status);
  else
    outcome.error = DescribeExit(status);
  // It waits until there are some, as for room on the disk.
  outcome.refused = lacks_threads && outcome.exit_status.value_or(kExitFailed) == kExitFailed;
  return outcome;
}

void OperationQueue::Conclude(Entry& entry, const Outcome& outcome) const {
  v1::Operation& operation = entry.operation;
  operation.set_message(EscapedText(outcome.error));
  operation.set_output(IsUtf8(outcome.output) ? outcome.output : EscapedText(outcome.output));
  operation.clear_notes();
  for (const std::string& note : outcome.notes) operation.add_notes(EscapedText(note));
  if (entry.cancelled) {
    operation.set_state(v1::JOB_STATE_CANCELLED);
  } else if (outcome.refused) {
    operation.set_state(v1::JOB_STATE_QUEUED);  // it waits for room
    return;
  } else if (!outcome.exit_status) {
    operation.set_crashes(operation.crashes() + 1);
    operation.set_state(operation.crashes() < kMostCrashes ? v1::JOB_STATE_QUEUED : v1::JOB_STATE_FAILED);
    if (operation.state() == v1::JOB_STATE_QUEUED) return;
  } else {
    operation.set_exit_status(*outcome.exit_status);
    const bool is_done =
        *outcome.exit_status == kExitDone || (*outcome.exit_status == kExitFailed && outcome.error.empty());
    operation.set_state(is_done ? v1::JOB_STATE_DONE : v1::JOB_STATE_FAILED);
    if (is_done && FindOperationKind(operation.spec().command())->out() == v1::WORK_OUT_TAKE) {
      const absl::Status adopted =
          options_.adopt_take(absl::StrCat(OutOf(operation.id()), "/take"), operation.id());
      if (adopted.ok()) {
        operation.set_take_id(operation.id());
      } else {
        operation.set_state(v1::JOB_STATE_FAILED);
        operation.set_message(EscapedText(std::string(adopted.message())));
      }
    }
  }
  operation.set_share_done(operation.state() == v1::JOB_STATE_DONE ? 1 : operation.share_done());
  operation.set_finished_unix_ns(HostTime_ns());
  spdlog::info("operation {}: {} {}", operation.id(), v1::JobState_Name(operation.state()),
               operation.message());
}

}  // namespace weft
