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
// works for every call that is cancelled at once (CVE-2023-44487). So what a TCP connection sends is held
// against what is heard of it: calls that begin, and their messages. One that owes more than
// kMostUnheard_bytes is shut down; kFree_bytes_per_s are for windows and pings. Sockets of the file system,
// which are the daemon's own user's, are not counted. Thread safety: any thread.
class ReceiveGuard {
 public:
  static constexpr double kMostUnheard_bytes = 16 << 20;  // parts of messages, which have 1 MiB at the most
  static constexpr double kFree_bytes_per_s = 1 << 20;

  // A connected socket, which gRPC will close.
  void Add(int socket, ino_t inode);
  void Remove(ino_t inode);
  // A call, or a message of so many bytes, of the connection that gRPC calls `peer`: "ipv4:10.0.0.5:43210".
  void HeardCall(const std::string& peer);
  void HeardMessage(const std::string& peer, size_t bytes);
  // Shuts down what sends too much; returns the inodes.
  std::vector<ino_t> Check();

 private:
  struct Watched {
    int socket = -1;
    std::string peer;
    double read_bytes = 0, heard_bytes = 0;
    double owed_bytes = 0;  // at the last Check
    bool ended = false;
  };
  void Credit(const std::string& peer, double bytes);

  std::mutex mutex_;
  std::map<ino_t, Watched> connections_;
  std::map<std::string, ino_t> by_peer_;
  std::chrono::steady_clock::time_point checked_ = std::chrono::steady_clock::now();
};

}  // namespace weft
