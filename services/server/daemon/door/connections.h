// Connections on their way to gRPC.
#pragma once

#include <grpcpp/server_builder.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/callers/peer_budget.h"
#include "services/server/daemon/door/call_check.h"
#include "services/server/daemon/door/connection_handover.h"
#include "services/server/daemon/door/listen_address.h"
#include "services/server/daemon/door/receive_guard.h"

namespace weft {

struct ConnectionLimits {
  int all = 1000;
  int of_one_peer = 250;
  // Beyond `all`, for the daemon's own user and root: who floods it locks neither them nor the watchdog out.
  int reserve = 16;
};

// What a process that may have so many descriptors can keep open beside its files, workers and catalogue.
ConnectionLimits LimitsFor(int64_t descriptors);
// Of this process; the log says when they are low.
ConnectionLimits LimitsOfProcess();

// Accepts connections, and hands them to gRPC, whose own listener stands still for good once descriptors ran
// out (CVE-2023-4785, in 1.51). So many connections are open at once, in all and of one peer: further ones
// are closed at once, and the logs name their peers, also those whose connections end without a call. A peer,
// which is a user of this machine or the address of another, has a CallCheck of its own while it is
// connected.
class Connections {
 public:
  using CredentialsOf = std::function<std::shared_ptr<grpc::ServerCredentials>(ListenKind kind)>;
  // Adds acceptors to `builder`, so it comes before the server is built. `credentials_of` is called for each
  // peer that may be connected at once.
  Connections(std::vector<ListeningSocket> sockets, ConnectionLimits limits, const CallerSources& sources,
              const CredentialsOf& credentials_of, grpc::ServerBuilder& builder);
  ~Connections();

  // Accepts from now on, which needs a server that runs. Unavailable: /proc is not there.
  absl::Status Begin();
  // A connection from the console of this process, for a browser at this address. Needs a listener of the
  // kind kConsole. ResourceExhausted: too many are connected.
  absl::StatusOr<UniqueFd> ConnectConsole(const std::string& browser);
  // Accepts no more, and removes sockets of the file system; what is connected stays.
  void Stop();

  int open() const { return open_now_; }
  int most() const { return limits_.all; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Slot;
  struct Listener;

  void Run(const std::stop_token& stop);
  void Guard(const std::stop_token& stop);
  void Accept(Listener& listener);
  // False: it was closed.
  bool Admit(Listener& listener, UniqueFd connection, const Peer& peer);
  Slot& SlotOf(Listener& listener, const Peer& peer) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Empty: it may come.
  std::string WhyRefused(const Slot& slot, const Peer& peer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool HasRoom(const Slot& slot, const Peer& peer) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Notices connections that gRPC has closed.
  void CountOpen() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Notify(Slot& slot) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void EndNoisy(double passed_s) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Those of a peer whose calls are refused again and again.
  void EndRefused(Slot& slot, double passed_s) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ReportViolation(const Slot& slot, const std::string& message, int offences)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const ConnectionLimits limits_;
  AuditLog& audit_;
  ReceiveGuard& guard_;
  Mutex mutex_;                                       // of slots, too
  std::vector<std::unique_ptr<Listener>> listeners_;  // as they were made, until Stop
  std::condition_variable_any came_;
  std::map<ino_t, Slot*> open_ ABSL_GUARDED_BY(mutex_);
  std::atomic<int> open_now_ = 0;
  PeerBudget budget_ ABSL_GUARDED_BY(mutex_);
  Clock::time_point counted_ ABSL_GUARDED_BY(mutex_);
  UniqueFd wake_;
  ConnectionHandover handover_;
  std::jthread accepting_, guarding_;
};

}  // namespace weft
