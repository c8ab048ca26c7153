// Whether a daemon serves, as gRPC's health service says it.
#pragma once

#include <grpcpp/health_check_service_interface.h>

#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace weft {

// Looks each half second, and tells the service and the log of changes. Thread safety: any thread.
class HealthWatch {
 public:
  // `trouble` says why the daemon does not serve; empty: it does. `service` outlives this.
  HealthWatch(grpc::HealthCheckServiceInterface& service, std::function<std::string()> trouble);
  ~HealthWatch();
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;

  bool serving() const { return serving_; }

 private:
  void Watch(const std::stop_token& stop);
  // Of every service, and of the daemon as a whole.
  void Say(bool serving);

  grpc::HealthCheckServiceInterface& service_;
  const std::function<std::string()> trouble_;
  std::atomic<bool> serving_ = true;
  std::jthread thread_;
};

}  // namespace weft
