// Calls whose client neither takes nor sends anything.
#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/server_context.h>

#include <chrono>
#include <memory>

namespace weft {

// Cancels a call that does not move for `patience`, or at most twice as long. gRPC buffers megabytes of a
// stream, so a slow client seems to stand still meanwhile: `patience` must be long beside that. It ends
// before its call does. Thread safety: any thread; no function waits for another one.
class StallWatch {
 public:
  static constexpr std::chrono::seconds kReadTimeout{60};

  explicit StallWatch(grpc::ServerContextBase* context, std::chrono::milliseconds patience = kReadTimeout);
  ~StallWatch();
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;

  void Moved();
  // Nothing is expected of the client until Moved.
  void Rest();
  // How a call that failed has ended: DEADLINE_EXCEEDED where it was cancelled for not moving.
  grpc::Status StatusOfFailure() const;

 private:
  struct State;

  const std::shared_ptr<State> state_;
};

}  // namespace weft
