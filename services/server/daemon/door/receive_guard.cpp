#include "services/server/daemon/door/receive_guard.h"

#include <arpa/inet.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace weft {
namespace {

// As gRPC writes it, but for the brackets of IPv6.
std::string PeerText(int socket) {
  sockaddr_storage address = {};
  socklen_t bytes = sizeof address;
  char text[INET6_ADDRSTRLEN] = "";
  if (getpeername(socket, reinterpret_cast<sockaddr*>(&address), &bytes) != 0) return "";
  if (address.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    inet_ntop(AF_INET, &v4.sin_addr, text, sizeof text);
    return absl::StrCat("ipv4:", text, ":", ntohs(v4.sin_port));
  }
  if (address.ss_family != AF_INET6) return "";
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) {
    inet_ntop(AF_INET, v6.sin6_addr.s6_addr + 12, text, sizeof text);
    return absl::StrCat("ipv4:", text, ":", ntohs(v6.sin6_port));
  }
  inet_ntop(AF_INET6, &v6.sin6_addr, text, sizeof text);
  return absl::StrCat("ipv6:[", text, "]:", ntohs(v6.sin6_port));
}

struct Traffic {
  double read_bytes = 0;  // by gRPC
  double sent_bytes = 0;
};

std::optional<Traffic> TrafficOf(int socket) {
  tcp_info info = {};
  socklen_t bytes = sizeof info;
  int waiting_bytes = 0;
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &bytes) != 0) return std::nullopt;
  if (ioctl(socket, FIONREAD, &waiting_bytes) != 0) return std::nullopt;
  return Traffic{static_cast<double>(info.tcpi_bytes_received) - waiting_bytes,
                 static_cast<double>(info.tcpi_bytes_acked)};
}

}  // namespace

void ReceiveGuard::Add(int socket, ino_t inode) {
  std::string peer = PeerText(socket);
  if (peer.empty()) return;
  const MutexLock lock(mutex_);
  by_peer_[peer] = inode;
  Watched& watched = connections_[inode];
  watched = {};
  watched.socket = socket;
  watched.peer = std::move(peer);
  watched.looked = Clock::now();
}

void ReceiveGuard::Remove(ino_t inode) {
  const MutexLock lock(mutex_);
  const auto known = connections_.find(inode);
  if (known == connections_.end()) return;
  const auto peer = by_peer_.find(known->second.peer);
  if (peer != by_peer_.end() && peer->second == inode) by_peer_.erase(peer);
  connections_.erase(known);
}

ReceiveGuard::Watched* ReceiveGuard::Find(const std::string& peer) {
  const auto known = by_peer_.find(absl::StrReplaceAll(peer, {{"%5B", "["}, {"%5D", "]"}}));
  return known == by_peer_.end() ? nullptr : &connections_[known->second];
}

void ReceiveGuard::HeardCall(const std::string& peer) {
  constexpr double kHeaders_bytes = 2048;  // a token, a key, and TLS around them
  const MutexLock lock(mutex_);
  Watched* const watched = Find(peer);
  if (watched == nullptr) return;
  watched->heard_bytes += kHeaders_bytes;
  ++watched->awaiting;
  watched->called = true;
}

void ReceiveGuard::HeardMessage(const std::string& peer, size_t bytes) {
  constexpr double kFrames = 1.05;  // of HTTP/2 and TLS around it
  const MutexLock lock(mutex_);
  if (Watched* const watched = Find(peer)) watched->heard_bytes += kFrames * static_cast<double>(bytes);
}

void ReceiveGuard::Drained(const std::string& peer) {
  const MutexLock lock(mutex_);
  Watched* const watched = Find(peer);
  // Another connection may have taken the name.
  if (watched != nullptr && watched->awaiting > 0) --watched->awaiting;
}

// gRPC may have closed it, and the number may be another one's by now.
bool ReceiveGuard::IsOpen(ino_t inode, const Watched& watched) {
  struct stat file = {};
  return fstat(watched.socket, &file) == 0 && file.st_ino == inode;
}

void ReceiveGuard::ShutDown(ino_t inode, Watched& watched) {
  watched.ended = true;
  if (!IsOpen(inode, watched)) return;
  // Without a farewell: what waits in the kernel is not worth waiting for.
  const linger at_once = {1, 0};
  setsockopt(watched.socket, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  shutdown(watched.socket, SHUT_RDWR);
}

double ReceiveGuard::Excess_bytes(Watched& watched, Clock::time_point now) {
  const std::optional<Traffic> traffic = TrafficOf(watched.socket);
  if (!traffic) return 0;
  const double passed_s = std::chrono::duration<double>(now - watched.looked).count();
  const double free_bytes =
      kFree_bytes_per_s * passed_s + kFreeOfSent * (traffic->sent_bytes - watched.sent_bytes);
  const double unheard_bytes = traffic->read_bytes - watched.read_bytes - watched.heard_bytes;
  watched.owed_bytes = std::max(0.0, watched.owed_bytes + unheard_bytes - free_bytes);
  watched.read_bytes = traffic->read_bytes;
  watched.sent_bytes = traffic->sent_bytes;
  watched.heard_bytes = 0;
  watched.looked = now;
  const double messages_bytes = std::min(kMostMessages_bytes, kMessage_bytes * watched.awaiting);
  return watched.owed_bytes - kMostUnheard_bytes - messages_bytes;
}

std::vector<ReceiveGuard::Ended> ReceiveGuard::Check() {
  const MutexLock lock(mutex_);
  const Clock::time_point now = Clock::now();
  std::vector<Ended> ended;
  for (auto& [inode, watched] : connections_) {
    if (watched.ended || watched.checks_to_skip-- > 0) continue;
    if (!IsOpen(inode, watched)) {
      watched.ended = true;
      if (!watched.called && watched.owed_bytes > kMostSilent_bytes)
        ended.push_back({inode, Ended::kWithoutCall});
      continue;
    }
    const double excess_bytes = Excess_bytes(watched, now);
    watched.checks_to_skip = watched.owed_bytes > 0 ? 0 : kQuietChecks - 1;
    if (excess_bytes <= 0) continue;
    ShutDown(inode, watched);
    ended.push_back({inode, excess_bytes > kFlood_bytes ? Ended::kFlood : Ended::kOwesTooMuch});
  }
  return ended;
}

void ReceiveGuard::End(ino_t inode) {
  const MutexLock lock(mutex_);
  const auto known = connections_.find(inode);
  if (known != connections_.end() && !known->second.ended) ShutDown(inode, known->second);
}

}  // namespace weft
