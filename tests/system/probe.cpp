// probe SERVER JOB PER_S: a client that behaves well. Asks for the job at this rate, each call due at its
// time, and prints what it saw since the last line whenever a line comes on standard input: JSON with
// latencies in milliseconds and the number of calls that failed. Ends with its standard input.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_format.h"
#include "services/tools/client/channel.h"
#include "weft/v1/jobs.grpc.pb.h"

namespace weft {
namespace {

using Clock = std::chrono::steady_clock;

struct Seen {
  std::mutex mutex;
  std::vector<double> ms;
  int failed = 0;
  std::string reason;

  void Add(Clock::duration lasted, const grpc::Status& status) {
    const std::lock_guard lock(mutex);
    ms.push_back(std::chrono::duration<double, std::milli>(lasted).count());
    if (status.ok()) return;
    ++failed;
    reason = status.error_message();
  }
  std::string TakeJson() {
    const std::lock_guard lock(mutex);
    std::sort(ms.begin(), ms.end());
    const auto at = [this](double share) {
      return ms.empty()
                 ? -1
                 : ms[std::min(ms.size() - 1, static_cast<size_t>(share * static_cast<double>(ms.size())))];
    };
    std::replace(reason.begin(), reason.end(), '"', '\'');
    std::string json =
        absl::StrFormat(R"({"n": %d, "p50": %.3f, "p99": %.3f, "max": %.3f, "failed": %d, "reason": "%s"})",
                        ms.size(), at(.5), at(.99), at(1), failed, reason);
    ms.clear();
    failed = 0;
    reason.clear();
    return json;
  }
};

int Probe(char** argv) {
  const auto stub = v1::Jobs::NewStub(OpenChannel(argv[1], ClientIdentity::FromEnvironment()).value());
  const std::chrono::duration<double> period(1 / std::atof(argv[3]));
  Seen seen;
  // Calls that block, in turn: queues of completions may stand still while one call is open at a time.
  constexpr int kThreads = 32;
  const Clock::time_point begin = Clock::now();
  std::vector<std::jthread> callers;
  for (int first = 0; first < kThreads; ++first) {
    callers.emplace_back([&, first](const std::stop_token& stop) {
      for (int i = first; !stop.stop_requested(); i += kThreads) {
        const Clock::time_point due = begin + std::chrono::duration_cast<Clock::duration>(i * period);
        std::this_thread::sleep_until(due);
        grpc::ClientContext context;
        context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
        v1::GetJobRequest request;
        request.set_job_id(argv[2]);
        v1::Job job;
        const grpc::Status status = stub->GetJob(&context, request, &job);
        seen.Add(Clock::now() - due, status);
      }
    });
  }
  for (int c = 0; (c = std::getchar()) != EOF;) {
    if (c != '\n') continue;
    std::printf("%s\n", seen.TakeJson().c_str());
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) { return argc == 4 ? weft::Probe(argv) : 2; }
