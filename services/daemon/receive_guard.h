// Connections that send and send, and no call comes of it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace weft {

// gRPC 1.51 keeps a block of headers in memory until its end, however long it gets (CVE-2023-33953), and
// works for every frame of control and every call that is refused or cancelled at once (CVE-2023-44487). So
// what a TCP connection sends is held against what is heard of it: calls that are let in, and their messages.
// One that owes more than it may is shut down. Sockets of the file system, which are the daemon's own user's,
// are not counted. Thread safety: any thread.
class ReceiveGuard {
 public:
  // What a call may send ahead of its reader (HTTP/2's window of a stream), and the largest message.
  static constexpr int kWindow_bytes = 1 << 20;
  static constexpr int kLargestMessage_bytes = 1 << 20;
  // What a connection may owe: TLS handshake, headers, windows; and both for each call that awaits messages.
  static constexpr double kMostUnheard_bytes = 256 << 10;
  static constexpr double kMessage_bytes = kWindow_bytes + kLargestMessage_bytes;
  static constexpr double kMostMessages_bytes = 16 << 20;
  // For windows and pings, which come with what is sent to it.
  static constexpr double kFree_bytes_per_s = 32 << 10;
  static constexpr double kFreeOfSent = 0.02;

  // A connected socket, which gRPC will close.
  void Add(int socket, ino_t inode);
  void Remove(ino_t inode);
  // A call that awaits messages, or a message of so many bytes, of the connection that gRPC calls `peer`:
  // "ipv4:10.0.0.5:43210". In the end the call awaits no more.
  void HeardCall(const std::string& peer);
  void HeardMessage(const std::string& peer, size_t bytes);
  void HeardAll(const std::string& peer);
  // Shuts down what sends too much; returns the inodes.
  std::vector<ino_t> Check();
  // Shuts this connection down.
  void End(ino_t inode);

 private:
  struct Watched {
    int socket = -1;
    std::string peer;
    double read_bytes = 0, sent_bytes = 0;  // by the kernel
    double heard_bytes = 0;
    int awaiting = 0;       // calls
    double owed_bytes = 0;  // at the last Check
    bool ended = false;
  };
  Watched* Find(const std::string& peer);
  static void ShutDown(ino_t inode, Watched& watched);

  std::mutex mutex_;
  std::map<ino_t, Watched> connections_;
  std::map<std::string, ino_t> by_peer_;
  std::chrono::steady_clock::time_point checked_ = std::chrono::steady_clock::now();
};

}  // namespace weft
