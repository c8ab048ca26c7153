// Connections that send and send, and no call comes of it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "base/mutex.h"
#include "services/server/rpc/message_limit.h"

namespace weft {

// gRPC 1.51 keeps a block of headers in memory until its end, however long it gets (CVE-2023-33953), and
// works for every frame of control and every call that is refused or cancelled at once (CVE-2023-44487). So
// what a TCP connection sends is held against what is heard of it: calls that are let in, and their messages.
// One that owes more than it may is shut down. Sockets of the file system, which are the daemon's own user's,
// are not counted. A look at a connection costs two system calls, so those that have been quiet for a while
// are looked at less often. Thread safety: any thread.
class ReceiveGuard {
 public:
  // What a call may send ahead of its reader: HTTP/2's window of a stream.
  static constexpr int kWindow_bytes = 1 << 20;
  // What gRPC reads of a connection at once, and what the kernel keeps for it.
  static constexpr int kReadAtOnce_bytes = 64 << 10, kReceiveBuffer_bytes = 128 << 10;
  // What a connection may owe: TLS handshake, headers, windows, and a message, since calls with one message
  // are heard of when it is complete. And a window and a message for each call that awaits more.
  static constexpr double kMostUnheard_bytes = (256 << 10) + kWindow_bytes;
  static constexpr double kMessage_bytes = kWindow_bytes + kLargestRequest_bytes;
  static constexpr double kMostMessages_bytes = 16 << 20;
  // For windows and pings, which come with what is sent to it.
  static constexpr double kFree_bytes_per_s = 32 << 10;
  static constexpr double kFreeOfSent = 0.02;
  // So much more than it may owe is no mistake.
  static constexpr double kFlood_bytes = 256 << 10;
  // gRPC ends connections by itself, over pings for instance. One without a call offends when it owes more:
  // a TLS handshake is smaller.
  static constexpr double kMostSilent_bytes = 48 << 10;
  // A connection that owes nothing is looked at in each so-many-th Check.
  static constexpr int kQuietChecks = 5;

  struct Ended {
    ino_t inode = 0;
    enum Reason { kOwesTooMuch, kFlood, kWithoutCall } reason = kOwesTooMuch;
  };

  // A connected socket, which gRPC will close.
  void Add(int socket, ino_t inode);
  void Remove(ino_t inode);
  // A call that awaits messages, or a message of so many bytes, of the connection that gRPC calls `peer`:
  // "ipv4:10.0.0.5:43210". In the end the call awaits no more.
  void HeardCall(const std::string& peer);
  void HeardMessage(const std::string& peer, size_t bytes);
  void Drained(const std::string& peer);
  // Shuts down what sends too much, and tells of those that gRPC ended for it.
  std::vector<Ended> Check();
  // Shuts this connection down.
  void End(ino_t inode);

 private:
  using Clock = std::chrono::steady_clock;
  struct Watched {
    int socket = -1;
    std::string peer;
    double read_bytes = 0, sent_bytes = 0;  // by the kernel
    double heard_bytes = 0;
    int awaiting = 0;  // calls
    bool called = false;
    double owed_bytes = 0;  // when it was last looked at
    Clock::time_point looked;
    int checks_to_skip = 0;
    bool ended = false;
  };
  Watched* Find(const std::string& peer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // What it owes beyond what it may; 0 or less in honest ones.
  static double Excess_bytes(Watched& watched, Clock::time_point now);
  static bool IsOpen(ino_t inode, const Watched& watched);
  static void ShutDown(ino_t inode, Watched& watched);

  Mutex mutex_;
  std::map<ino_t, Watched> connections_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, ino_t> by_peer_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
