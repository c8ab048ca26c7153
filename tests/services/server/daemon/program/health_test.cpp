#include "services/server/daemon/program/health.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <thread>

namespace weft {
namespace {

class PlayedHealthService final : public grpc::HealthCheckServiceInterface {
 public:
  void SetServingStatus(const std::string& service_name, bool serving) override {
    const std::lock_guard lock(mutex_);
    said_[service_name] = serving;
  }
  void SetServingStatus(bool serving) override { SetServingStatus("", serving); }
  bool Said(const std::string& service_name) {
    const std::lock_guard lock(mutex_);
    return said_.at(service_name);
  }

 private:
  std::mutex mutex_;
  std::map<std::string, bool> said_;
};

// Whether the service is told so within half a minute.
bool IsTold(PlayedHealthService& service, bool serving) {
  for (int i = 0; i < 3000 && service.Said("weft.v1.Takes") != serving; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return service.Said("weft.v1.Takes") == serving;
}

TEST(HealthWatch, SaysOfEveryServiceWhetherItServes) {
  PlayedHealthService service;
  std::atomic<bool> is_full = false;
  HealthWatch watch(service, [&] { return is_full ? "the disk is full" : ""; });
  EXPECT_TRUE(watch.serving());
  EXPECT_TRUE(service.Said("weft.v1.Jobs"));
  is_full = true;
  ASSERT_TRUE(IsTold(service, false));
  EXPECT_FALSE(watch.serving());
  is_full = false;
  ASSERT_TRUE(IsTold(service, true));
  EXPECT_TRUE(watch.serving());
}

}  // namespace
}  // namespace weft
