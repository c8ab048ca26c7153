#include "services/server/daemon/program/health.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <condition_variable>
#include <utility>

#include "base/mutex.h"
#include "capture/file/plain_text.h"
#include "services/server/rpc/service_files.h"

namespace weft {
namespace {

constexpr std::chrono::milliseconds kLookEvery{500};

}  // namespace

HealthWatch::HealthWatch(grpc::HealthCheckServiceInterface& service, std::function<std::string()> trouble)
    : service_(service), trouble_(std::move(trouble)) {
  Say(true);
  thread_ = std::jthread([this](const std::stop_token& stop) { Watch(stop); });
}

HealthWatch::~HealthWatch() = default;

void HealthWatch::Say(bool serving) {
  serving_ = serving;
  service_.SetServingStatus(serving);
  for (const google::protobuf::FileDescriptor* file : ServiceFiles()) {
    for (int i = 0; i < file->service_count(); ++i)
      service_.SetServingStatus(file->service(i)->full_name(), serving);
  }
}

void HealthWatch::Watch(const std::stop_token& stop) {
  Mutex mutex;
  std::condition_variable_any asked;
  MutexLock lock(mutex);
  while (!asked.wait_for(lock, stop, kLookEvery, [&] { return stop.stop_requested(); })) {
    if (stop.stop_requested()) return;
    const std::string trouble = trouble_();
    if (trouble.empty() == serving_) continue;
    if (trouble.empty()) {
      spdlog::info("serves again");
    } else {
      spdlog::error("does not serve: {}", EscapedText(trouble));
    }
    Say(trouble.empty());
  }
}

}  // namespace weft
