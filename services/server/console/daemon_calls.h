// Calls of the daemon's own API for browsers, without a thread for each.
#pragma once

#include "base/mutex.h"
#include "services/server/console/awaitable.h"

#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// For whom a call is made.
struct CallFor {
  std::string session;       // calls of one share a connection
  std::string peer;          // the browser's address, for audit.log
  std::string token_sha256;  // whose role counts
};

// Makes calls over connections whose other end is the daemon's, so that its roles, limits, audit and errors
// hold for browsers as they do for every client. Functions that are awaited run in the executor of whoever
// awaits them. Thread safety: any thread; one call is one caller's.
class DaemonCalls {
 public:
  // Connects to the daemon as from this peer.
  using Connect = std::function<absl::StatusOr<UniqueFd>(const std::string& peer)>;

  explicit DaemonCalls(Connect connect);
  // Cancels what runs. Nobody may await anything any more.
  ~DaemonCalls();

  class Call;
  // A call with one message from here, given as bytes; where that is an error, it is the result. `path` as in
  // HTTP/2. The call ends after `patience`.
  absl::StatusOr<std::shared_ptr<Call>> Begin(const CallFor& caller, const std::string& path,
                                              const absl::StatusOr<std::string>& request,
                                              std::chrono::milliseconds patience);

 private:
  // A connection that was given as a descriptor cannot be made again, and tells nobody its state.
  struct Channel {
    std::shared_ptr<grpc::Channel> channel;
    std::atomic<bool> broke = false;  // a call was told so
    std::chrono::steady_clock::time_point used;
  };
  // Calls that are not forgotten yet, which may outlive this.
  struct Running {
    Mutex mutex;
    std::set<Call*> calls ABSL_GUARDED_BY(mutex);
  };
  absl::StatusOr<std::shared_ptr<Channel>> ChannelOf(const CallFor& caller);
  void Run();

  const Connect connect_;
  grpc::CompletionQueue queue_;
  Mutex mutex_;
  std::map<std::string, std::shared_ptr<Channel>> channels_ ABSL_GUARDED_BY(mutex_);  // by session
  const std::shared_ptr<Running> running_;
  std::thread thread_;
};

// Messages of the answer, one after the other; unary calls have one. Lives until its last operation ended.
class DaemonCalls::Call : public std::enable_shared_from_this<Call> {
 public:
  ~Call();

  // The next message; false: there are no more, and Finish tells why. One at a time.
  boost::asio::awaitable<bool> Read(std::string& message);
  // How the call ended; cancels it where it has not.
  boost::asio::awaitable<absl::Status> Finish();
  // From any thread: Read and Finish come to an end.
  void Cancel() { context_.TryCancel(); }

 private:
  friend class DaemonCalls;
  Call(std::shared_ptr<Running> running, std::shared_ptr<Channel> channel);
  boost::asio::awaitable<bool> Await(std::function<void(void* tag)> begin);

  const std::shared_ptr<Running> running_;
  const std::shared_ptr<Channel> channel_;
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
  grpc::ByteBuffer request_, answer_;
  grpc::Status status_;
  bool began_ = false, ended_ = false;
};

}  // namespace weft
