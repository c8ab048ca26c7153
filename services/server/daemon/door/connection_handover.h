// The step from an accepted connection to gRPC.
#pragma once

#include <grpcpp/server_builder.h>

#include <condition_variable>
#include <deque>
#include <thread>
#include <vector>

#include "base/mutex.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// Of threads that let connections in: calls of those that are connected go first.
constexpr int kNicenessOfNewConnections = 10;

// gRPC reads a new connection in the thread that hands it over, until nothing more comes. Whoever sends
// without a pause would hold the one thread that accepts, and ends such connections; so others do it. Thread
// safety: any thread.
class ConnectionHandover {
 public:
  using Acceptor = grpc::experimental::ExternalConnectionAcceptor;

  ConnectionHandover() = default;
  ~ConnectionHandover() { Stop(); }

  void Begin();
  // `acceptor` lives until Stop has returned.
  void HandOver(Acceptor& acceptor, int listener_fd, UniqueFd connection);
  // Closes connections that still wait. Returns when gRPC has let go of its threads, for which somebody must
  // end those that send on and on.
  void Stop();

 private:
  struct Waiting {
    Acceptor* acceptor;
    int listener_fd;
    UniqueFd connection;
  };
  void Run(const std::stop_token& stop);

  Mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Waiting> waiting_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::jthread> threads_;
};

}  // namespace weft
