#include "services/server/daemon/door/peer.h"

#include <arpa/inet.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <map>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "base/mutex.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/callers/network.h"

namespace weft {
namespace {

struct EndPoint {
  std::array<uint32_t, 4> address{};  // in network order; IPv4 uses the first
  in_port_t port = 0;                 // in network order
};

struct Ends {
  int family = AF_UNSPEC;
  EndPoint here, there;
};

EndPoint EndPointOf(const sockaddr_storage& name) {
  EndPoint end;
  if (name.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(name);
    end.address[0] = v4.sin_addr.s_addr;
    end.port = v4.sin_port;
  } else if (name.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(name);
    std::memcpy(end.address.data(), &v6.sin6_addr, sizeof(v6.sin6_addr));
    end.port = v6.sin6_port;
  }
  return end;
}

std::optional<Ends> EndsOf(int socket) {
  sockaddr_storage here{}, there{};
  socklen_t here_size = sizeof(here), there_size = sizeof(there);
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&here), &here_size) != 0 ||
      getpeername(socket, reinterpret_cast<sockaddr*>(&there), &there_size) != 0) {
    return std::nullopt;
  }
  return Ends{there.ss_family, EndPointOf(here), EndPointOf(there)};
}

bool IsLoopbackPeer(const Ends& ends) {
  if (ends.family == AF_INET) return (ntohl(ends.there.address[0]) >> 24) == 127;
  in6_addr address{};
  std::memcpy(&address, ends.there.address.data(), sizeof(address));
  return ends.family == AF_INET6 && IN6_IS_ADDR_LOOPBACK(&address);
}

std::optional<uid_t> AskKernel(const Ends& ends) {
  struct {
    nlmsghdr header;
    inet_diag_req_v2 request;
  } message{};
  message.header.nlmsg_len = sizeof(message);
  message.header.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  message.header.nlmsg_flags = NLM_F_REQUEST;
  inet_diag_req_v2& request = message.request;
  request.sdiag_family = static_cast<uint8_t>(ends.family);
  request.sdiag_protocol = IPPROTO_TCP;
  request.idiag_states = UINT32_MAX;
  std::memcpy(request.id.idiag_src, ends.there.address.data(), sizeof(request.id.idiag_src));
  std::memcpy(request.id.idiag_dst, ends.here.address.data(), sizeof(request.id.idiag_dst));
  request.id.idiag_sport = ends.there.port;
  request.id.idiag_dport = ends.here.port;
  request.id.idiag_cookie[0] = request.id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  const UniqueFd kernel(socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_SOCK_DIAG));
  alignas(nlmsghdr) std::array<char, 1024> answer{};
  if (!kernel.open() || send(kernel.get(), &message, sizeof(message), 0) < 0) return std::nullopt;
  const ssize_t size = recv(kernel.get(), answer.data(), answer.size(), 0);
  const auto& header = reinterpret_cast<const nlmsghdr&>(answer);
  if (size < static_cast<ssize_t>(NLMSG_LENGTH(sizeof(inet_diag_msg))) ||
      header.nlmsg_type != SOCK_DIAG_BY_FAMILY) {
    return std::nullopt;
  }
  inet_diag_msg found{};
  std::memcpy(&found, answer.data() + NLMSG_HDRLEN, sizeof(found));
  // The kernel calls a socket that its program has closed root's, though its data is still on the way.
  const bool is_open = found.idiag_state == TCP_ESTABLISHED && found.idiag_inode != 0;
  return is_open ? std::optional<uid_t>(found.idiag_uid) : std::nullopt;
}

// As the table writes it: words of the address in the machine's order, then the port.
std::string HexOf(const EndPoint& end, size_t words) {
  std::string text;
  for (size_t i = 0; i < words; ++i) absl::StrAppendFormat(&text, "%08X", end.address[i]);
  return absl::StrFormat("%s:%04X", text, ntohs(end.port));
}

// The same from a table of all connections, proc(5): state 01 is established.
std::optional<uid_t> FindInTable(const char* path, const std::string& local, const std::string& remote) {
  std::ifstream table(path);
  for (std::string line; std::getline(table, line);) {
    constexpr size_t kLocal = 1, kRemote = 2, kState = 3, kUid = 7, kInode = 9;
    const std::vector<std::string> columns = absl::StrSplit(line, ' ', absl::SkipEmpty());
    uid_t uid = 0;
    if (columns.size() > kInode && columns[kLocal] == local && columns[kRemote] == remote &&
        columns[kState] == "01" && columns[kInode] != "0" && absl::SimpleAtoi(columns[kUid], &uid)) {
      return uid;
    }
  }
  return std::nullopt;
}

std::optional<uid_t> ReadTables(const Ends& ends) {
  constexpr char kTable4[] = "/proc/net/tcp", kTable6[] = "/proc/net/tcp6";
  if (ends.family == AF_INET6) return FindInTable(kTable6, HexOf(ends.there, 4), HexOf(ends.here, 4));
  const std::string there = HexOf(ends.there, 1), here = HexOf(ends.here, 1);
  if (const std::optional<uid_t> owner = FindInTable(kTable4, there, here)) return owner;
  // Programs may reach an IPv4 address by a socket of IPv6, as gRPC does (RFC 4291, 2.5.5.2).
  const std::string mapped = "0000000000000000FFFF0000";
  return FindInTable(kTable6, mapped + there, mapped + here);
}

// The owner of the socket at the other end of a connection within this machine, whose own address is our
// peer's. Small kernels lack tcp_diag.
std::optional<uid_t> OwnerOfOtherEnd(const Ends& ends) {
  static std::atomic<bool> kernel_answers = false;
  const std::optional<uid_t> owner = AskKernel(ends);
  if (owner) kernel_answers = true;
  // Tables are slow, and a flood of connections that are closed at once must not make us read them.
  return owner || kernel_answers ? owner : ReadTables(ends);
}

std::string ReadNameOfUser(uid_t uid) {
  passwd user{};
  passwd* found = nullptr;
  std::vector<char> text(16384);
  getpwuid_r(uid, &user, text.data(), text.size(), &found);
  return found == nullptr ? absl::StrCat("uid ", uid) : found->pw_name;
}

// A flood of connections must not make us read the list of users, or ask a directory server, for each.
std::string NameOfUser(uid_t uid) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kKept{10};
  constexpr size_t kMostUsers = 1000;
  struct Known {
    std::string name;
    Clock::time_point read;
  };
  static Mutex mutex;
  static std::map<uid_t, Known> users ABSL_GUARDED_BY(mutex);
  const Clock::time_point now = Clock::now();
  {
    const MutexLock lock(mutex);
    const auto known = users.find(uid);
    if (known != users.end() && now - known->second.read < kKept) return known->second.name;
  }
  std::string name = ReadNameOfUser(uid);
  const MutexLock lock(mutex);
  if (users.size() >= kMostUsers) users.clear();
  users[uid] = {name, now};
  return name;
}

Peer LocalPeer(uid_t uid) { return {absl::StrCat("user ", NameOfUser(uid)), uid}; }

}  // namespace

Peer PeerOf(int socket) {
  const std::optional<Ends> ends = EndsOf(socket);
  if (!ends) return {"nobody", std::nullopt};
  if (ends->family == AF_UNIX) {
    ucred credentials{};
    socklen_t size = sizeof(credentials);
    if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0)
      return {"nobody", std::nullopt};
    return LocalPeer(credentials.uid);
  }
  if (IsLoopbackPeer(*ends)) {
    if (const std::optional<uid_t> uid = OwnerOfOtherEnd(*ends)) return LocalPeer(*uid);
  }
  std::array<char, INET6_ADDRSTRLEN> text{};
  inet_ntop(ends->family, ends->there.address.data(), text.data(), text.size());
  return {NetworkOf(text.data()), std::nullopt};
}

std::string TrustedUserOf(const Peer& peer) {
  if (!peer.uid || (*peer.uid != 0 && *peer.uid != geteuid())) return "";
  return NameOfUser(*peer.uid);
}

}  // namespace weft
