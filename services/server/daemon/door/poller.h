// A thread that is always there to notice what arrives.
#pragma once

#include <grpcpp/server_builder.h>

#include <memory>
#include <thread>

namespace weft {

// One thread of gRPC at a time waits at the sockets for all others. In 1.51 the threads of its callback API
// may be the ones to wait, and sleep for 100 ms of each 1.1 s without handing over: then nobody notices what
// arrives. This thread, on a completion queue without calls, is there to take over; it does nothing else.
class Poller {
 public:
  // Before the server is built.
  explicit Poller(grpc::ServerBuilder& builder);
  // After the server has ended.
  ~Poller();
  Poller(const Poller&) = delete;
  Poller& operator=(const Poller&) = delete;

  // Once the server runs.
  void Begin();

 private:
  void Run();

  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  std::thread thread_;
};

}  // namespace weft
