// client_load FOLDER SERVER ECHO CLIENTS SECONDS WATCHED DONE [PER_S]: many clients of a daemon at once,
// beside a server that only echoes. FOLDER has ca.pem and token-0, token-1, ...; WATCHED is a job that runs,
// DONE one with a mesh. Asks PER_S times a second, by default half as often as the echo bears. Prints a line
// of JSON: latencies in milliseconds from the time at which a call was due.
#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/timed_id.h"
#include "capture/file/plain_text.h"
#include "services/tools/client/channel.h"
#include "services/tools/client/daemon_call.h"
#include "tests/system/unary_calls.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// Thread safety: any thread.
class Samples {
 public:
  void Add(Clock::duration lasted) {
    const std::lock_guard lock(mutex_);
    ms_.push_back(std::chrono::duration<double, std::milli>(lasted).count());
  }
  void Forget() {
    const std::lock_guard lock(mutex_);
    ms_.clear();
  }
  std::string Json() {
    const std::lock_guard lock(mutex_);
    std::sort(ms_.begin(), ms_.end());
    const auto at = [this](double share) {
      return ms_.empty() ? -1
                         : ms_[std::min(ms_.size() - 1,
                                        static_cast<size_t>(share * static_cast<double>(ms_.size())))];
    };
    return absl::StrFormat(R"({"n": %d, "p50": %.3f, "p99": %.3f, "max": %.3f})", ms_.size(), at(.5), at(.99),
                           at(1));
  }

 private:
  std::mutex mutex_;
  std::vector<double> ms_;
};

class Errors {
 public:
  void Note(const char* what, const grpc::Status& status) {
    if (status.ok() || ending) return;
    const std::lock_guard lock(mutex_);
    ++found_[absl::StrCat(what, ": ", status.error_code(), " ", status.error_message().substr(0, 120))];
  }
  std::string Json() {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> pairs;
    for (const auto& [text, times] : found_) {
      std::string escaped = EscapedText(text);
      std::replace(escaped.begin(), escaped.end(), '"', '\'');
      std::replace(escaped.begin(), escaped.end(), '\\', '/');
      pairs.push_back(absl::StrCat("\"", escaped, "\": ", times));
    }
    return absl::StrCat("{", absl::StrJoin(pairs, ", "), "}");
  }
  std::atomic<bool> ending = false;

 private:
  std::mutex mutex_;
  std::map<std::string, int> found_;
};

using Stub = std::unique_ptr<v1::Jobs::Stub>;

// GetJob of many clients in turn, without a thread per call.
class Reader {
 public:
  Reader(std::vector<Stub>& stubs, std::string job, Errors& errors)
      : stubs_(stubs), job_(std::move(job)), errors_(errors) {}

  // Each client asks again as soon as it is answered. Calls per second.
  double Saturate(Seconds lasts) {
    const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(lasts);
    std::atomic<int> calls = 0;
    const std::function<void(size_t)> ask = [&](size_t client) {
      Send(client, [&, client] {
        ++calls;
        if (Clock::now() < end) ask(client);
      });
    };
    for (size_t client = 0; client < stubs_.size(); ++client) ask(client);
    calls_.WaitForAll();
    return calls / lasts.count();
  }

  // Calls are due at this rate, whether or not earlier ones are answered.
  void OpenLoop(double per_s, Seconds lasts, Samples& samples) {
    const Clock::time_point begin = Clock::now();
    const int calls = static_cast<int>(per_s * lasts.count());
    for (int i = 0; i < calls; ++i) {
      const Clock::time_point due = begin + std::chrono::duration_cast<Clock::duration>(Seconds(i / per_s));
      std::this_thread::sleep_until(due);
      Send(static_cast<size_t>(i) % stubs_.size(), [&samples, due] { samples.Add(Clock::now() - due); });
    }
    calls_.WaitForAll();
  }

 private:
  void Send(size_t client, const std::function<void()>& answered) {
    calls_.Send(*stubs_[client], job_, [this, answered](const grpc::Status& status) {
      errors_.Note("GetJob", status);
      answered();
    });
  }

  std::vector<Stub>& stubs_;
  const std::string job_;
  Errors& errors_;
  UnaryCalls calls_;
};

struct Load {
  std::string folder, watched, done;
  std::vector<Stub> stubs, echo_stubs;
  v1::Job example;  // DONE
  Errors errors;
  Samples submits, cancels, fetches, syncs, updates;
  std::atomic<bool> stop = false;

  void ForgetSamples() {
    for (Samples* samples : {&submits, &cancels, &fetches, &syncs, &updates}) samples->Forget();
  }

  void Pause(std::chrono::milliseconds time) const {
    for (; time.count() > 0 && !stop; time -= std::chrono::milliseconds(50))
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }

  void Watch(const Stub& stub) {
    while (!stop) {
      grpc::ClientContext context;
      context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
      v1::WatchJobRequest request;
      request.set_job_id(watched);
      const auto stream = stub->WatchJob(&context, request);
      v1::JobUpdate update;
      const Clock::time_point begin = Clock::now();
      if (stream->Read(&update)) updates.Add(Clock::now() - begin);
      while (!stop && stream->Read(&update)) {
      }
      if (stop) context.TryCancel();
      const grpc::Status status = stream->Finish();
      if (status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED) errors.Note("WatchJob", status);
      Pause(std::chrono::milliseconds(500));
    }
  }

  void Submit(const Stub& stub) {
    while (!stop) {
      v1::SubmitJobRequest request;
      *request.mutable_spec() = example.spec();
      request.set_idempotency_key(NewTimedId());
      request.mutable_spec()->set_out(absl::StrCat(folder, "/data/out-", request.idempotency_key()));
      v1::Job job;
      const Clock::time_point begin = Clock::now();
      grpc::Status status = CallWhenAdmitted([&] {
        grpc::ClientContext context;
        return stub->SubmitJob(&context, request, &job);
      });
      submits.Add(Clock::now() - begin);
      errors.Note("SubmitJob", status);
      grpc::ClientContext context;
      v1::CancelJobRequest cancel;
      cancel.set_job_id(request.idempotency_key());
      const Clock::time_point submitted = Clock::now();
      errors.Note("CancelJob", stub->CancelJob(&context, cancel, &job));
      cancels.Add(Clock::now() - submitted);
      Pause(std::chrono::seconds(3));
    }
  }

  void Fetch(const Stub& stub) {
    while (!stop) {
      grpc::ClientContext context;
      v1::FetchResultRequest request;
      request.set_job_id(done);
      request.set_frame(example.first_frame());
      request.set_kind(v1::RESULT_KIND_MESH);
      const Clock::time_point begin = Clock::now();
      const auto stream = stub->FetchResult(&context, request);
      v1::FileChunk chunk;
      while (stream->Read(&chunk)) {
      }
      errors.Note("FetchResult", stream->Finish());
      fetches.Add(Clock::now() - begin);
      Pause(std::chrono::seconds(1));
    }
  }

  // What the disk takes for the least that a submission writes.
  void Sync() {
    const std::string path = absl::StrCat(folder, "/data/sync");
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const std::string page(4096, 'x');
    while (!stop) {
      const Clock::time_point begin = Clock::now();
      if (pwrite(file, page.data(), page.size(), 0) < 0 || fsync(file) != 0) break;
      syncs.Add(Clock::now() - begin);
      Pause(std::chrono::milliseconds(200));
    }
    close(file);
  }
};

double CpuSeconds() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

int Run(char** argv, double per_s) {
  const int clients = std::atoi(argv[4]);
  const Seconds lasts(std::atof(argv[5]));
  Load load;
  load.folder = argv[1];
  load.watched = argv[6];
  load.done = argv[7];
  for (int i = 0; i < clients; ++i) {
    const ClientIdentity identity{absl::StrCat(argv[1], "/token-", i), absl::StrCat(argv[1], "/ca.pem"), "",
                                  ""};
    load.stubs.push_back(v1::Jobs::NewStub(OpenChannel(argv[2], identity).value()));
    load.echo_stubs.push_back(v1::Jobs::NewStub(OpenChannel(argv[3], identity).value()));
  }
  grpc::ClientContext context;
  v1::GetJobRequest request;
  request.set_job_id(load.done);
  const grpc::Status known = load.stubs[0]->GetJob(&context, request, &load.example);
  if (!known.ok()) {
    std::fprintf(stderr, "client_load: %s\n", known.error_message().c_str());
    return 1;
  }
  Reader daemon(load.stubs, load.done, load.errors), echo(load.echo_stubs, load.done, load.errors);
  std::vector<std::jthread> threads;
  for (int i = 0; i < clients; ++i) {
    const Stub& stub = load.stubs[static_cast<size_t>(i)];
    threads.emplace_back([&load, &stub, i] {
      return i % 10 < 4 ? load.Watch(stub) : i % 10 < 7 ? load.Submit(stub) : load.Fetch(stub);
    });
  }
  threads.emplace_back([&load] { load.Sync(); });
  // All connect first.
  daemon.Saturate(Seconds(1));
  echo.Saturate(Seconds(1));
  const double echo_most = echo.Saturate(Seconds(5)), daemon_most = daemon.Saturate(Seconds(5));
  if (per_s == 0) per_s = echo_most / 2;
  load.ForgetSamples();
  // Both are asked in turn, so that what else the machine does comes to both.
  Samples echo_reads, daemon_reads;
  const double cpu_s = CpuSeconds();
  constexpr Seconds kTurn(5);
  const Clock::time_point begin = Clock::now();
  for (const Clock::time_point end = begin + std::chrono::duration_cast<Clock::duration>(lasts);
       Clock::now() < end;) {
    echo.OpenLoop(per_s, kTurn, echo_reads);
    daemon.OpenLoop(per_s, kTurn, daemon_reads);
  }
  const Seconds lasted = Clock::now() - begin;
  const double cores = (CpuSeconds() - cpu_s) / lasted.count();
  load.errors.ending = true;
  load.stop = true;
  threads.clear();
  std::printf(
      R"({"echo_saturation_per_s": %.0f, "daemon_saturation_per_s": %.0f, "open_loop_per_s": %.0f, "echo": %s, "daemon": %s, "submit": %s, "cancel": %s, "fetch": %s, "first_update": %s, "fsync": %s, "client_cpu_cores": %.3f, "lasted_s": %.1f, "errors": %s})"
      "\n",
      echo_most, daemon_most, per_s, echo_reads.Json().c_str(), daemon_reads.Json().c_str(),
      load.submits.Json().c_str(), load.cancels.Json().c_str(), load.fetches.Json().c_str(),
      load.updates.Json().c_str(), load.syncs.Json().c_str(), cores, lasted.count(),
      load.errors.Json().c_str());
  return 0;
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  return argc == 8 ? weft::Run(argv, 0) : argc == 9 ? weft::Run(argv, std::atof(argv[8])) : 2;
}
