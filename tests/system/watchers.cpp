// Many clients that watch one take and one job: watchers SERVER TAKE JOB CLIENTS. Each has a connection of
// its own. Ends when both have ended, or all streams broke, and prints one line of JSON: how many updates
// came, how old states were when they came, and what the first client learnt of backlog and latency.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/host_clock.h"
#include "weft/v1/jobs.grpc.pb.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {
namespace {

struct Watched {
  size_t take_updates = 0, job_updates = 0;
  std::vector<double> age_s;             // of a state of the take when it came
  std::vector<int> backlog;              // at each update while the take ran
  std::map<std::string, double> late_s;  // by frame
  std::string errors;
};

std::shared_ptr<grpc::Channel> ConnectAlone(const std::string& server) {
  grpc::ChannelArguments settings;
  settings.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  settings.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(server, grpc::InsecureChannelCredentials(), settings);
}

template <typename Stream, typename Update>
std::string ReadAll(Stream& stream, const std::function<void(const Update&)>& look) {
  Update update;
  while (stream.Read(&update)) look(update);
  const grpc::Status status = stream.Finish();
  return status.ok() ? "" : status.error_message();
}

std::string WatchTake(const std::shared_ptr<grpc::Channel>& channel, const std::string& id,
                      Watched* watched) {
  grpc::ClientContext context;
  v1::WatchTakeRequest request;
  request.set_take_id(id);
  const auto stream = v1::Takes::NewStub(channel)->WatchTake(&context, request);
  return ReadAll<grpc::ClientReader<v1::RecordedTake>, v1::RecordedTake>(
      *stream, [watched](const v1::RecordedTake& take) {
        // The first may have been written long before anybody watched.
        if (++watched->take_updates > 1)
          watched->age_s.push_back(static_cast<double>(HostTime_ns() - take.state().updated_unix_ns()) *
                                   1e-9);
      });
}

std::string WatchJob(const std::shared_ptr<grpc::Channel>& channel, const std::string& id, Watched* watched) {
  grpc::ClientContext context;
  v1::WatchJobRequest request;
  request.set_job_id(id);
  const auto stream = v1::Jobs::NewStub(channel)->WatchJob(&context, request);
  return ReadAll<grpc::ClientReader<v1::JobUpdate>, v1::JobUpdate>(
      *stream, [watched](const v1::JobUpdate& update) {
        ++watched->job_updates;
        if (update.job().live().following()) watched->backlog.push_back(update.job().live().backlog());
        for (const v1::FrameInfo& frame : update.frames())
          if (frame.latency_s() > 0) watched->late_s.emplace(frame.frame(), frame.latency_s());
      });
}

template <typename Values>
std::string Listed(const Values& values) {
  return absl::StrCat("[", absl::StrJoin(values, ","), "]");
}

void Print(const std::vector<Watched>& all) {
  const auto fewer = [](auto field) {
    return [field](const Watched& a, const Watched& b) { return a.*field < b.*field; };
  };
  size_t broken = 0;
  std::vector<double> worst_s, late_s;
  for (const Watched& one : all) {
    broken += !one.errors.empty();
    if (!one.age_s.empty()) worst_s.push_back(*std::max_element(one.age_s.begin(), one.age_s.end()));
    if (!one.errors.empty()) std::fprintf(stderr, "watchers: %s\n", one.errors.c_str());
  }
  for (const auto& [_, seconds] : all[0].late_s) late_s.push_back(seconds);
  absl::PrintF(
      "{\"clients\":%d,\"broken\":%d,\"least_take_updates\":%d,\"least_job_updates\":%d,\"age_s\":%s,"
      "\"worst_age_s\":%s,\"backlog\":%s,\"latency_s\":%s}\n",
      all.size(), broken,
      std::min_element(all.begin(), all.end(), fewer(&Watched::take_updates))->take_updates,
      std::min_element(all.begin(), all.end(), fewer(&Watched::job_updates))->job_updates,
      Listed(all[0].age_s), Listed(worst_s), Listed(all[0].backlog), Listed(late_s));
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  const int clients = argc == 5 ? std::atoi(argv[4]) : 0;
  if (clients < 1) {
    std::fprintf(stderr, "usage: watchers SERVER TAKE JOB CLIENTS\n");
    return 2;
  }
  std::vector<weft::Watched> watched(static_cast<size_t>(clients));
  {
    std::vector<std::jthread> threads;
    for (weft::Watched& one : watched) {
      threads.emplace_back([&one, argv] {
        const auto channel = weft::ConnectAlone(argv[1]);
        std::string of_job;
        std::jthread job([&] { of_job = weft::WatchJob(channel, argv[3], &one); });
        one.errors = weft::WatchTake(channel, argv[2], &one);
        job.join();
        one.errors += of_job;
      });
    }
  }
  weft::Print(watched);
}
