#include "services/server/daemon/door/listen_address.h"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr char kUnixPrefix[] = "unix:";
constexpr int kBacklog = 128;

using Addresses = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;

absl::Status WrongListen(const std::string& text, const std::string& why) {
  return absl::InvalidArgumentError(absl::StrCat("--listen: \"", text, "\" ", why));
}

absl::StatusOr<Addresses> AddressesOf(const ListenAddress& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found);
  if (error != 0) return WrongListen(address.text, absl::StrCat("names no host: ", gai_strerror(error)));
  return Addresses(found, freeaddrinfo);
}

bool IsLoopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    return (ntohl(v4.sin_addr.s_addr) >> 24) == 127;
  }
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  return address.sa_family == AF_INET6 && IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr);
}

absl::StatusOr<ListenAddress> ParseUnixSocket(const std::string& text) {
  ListenAddress address;
  address.text = text;
  address.path = text.substr(sizeof(kUnixPrefix) - 1);
  if (!absl::StartsWith(address.path, "/"))
    return WrongListen(text, "must name an absolute path, for example unix:/run/weft/weftd.sock");
  if (address.path.size() >= sizeof(sockaddr_un::sun_path))
    return WrongListen(text, absl::StrCat("is too long: sockets have paths of at most ",
                                          sizeof(sockaddr_un::sun_path) - 1, " characters"));
  return address;
}

absl::Status CannotListen(const ListenAddress& address, int error) {
  return absl::FailedPreconditionError(
      absl::StrCat("--listen: ", address.text, " cannot be listened on (", strerror(error),
                   "); is another program using it, or is the address not one of this machine's?"));
}

absl::StatusOr<ListeningSocket> ListenAtPath(const ListenAddress& address) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, address.path.c_str(), address.path.size() + 1);
  const auto* generic = reinterpret_cast<const sockaddr*>(&name);
  {
    const UniqueFd probe(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (connect(probe.get(), generic, sizeof(name)) == 0) return CannotListen(address, EADDRINUSE);
    struct stat file = {};
    const bool is_left_over =
        errno == ECONNREFUSED && lstat(name.sun_path, &file) == 0 && S_ISSOCK(file.st_mode);
    if (is_left_over) unlink(name.sun_path);
  }
  UniqueFd listening(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  // Before it has a name: bind takes the mode from here, so that nobody gets in meanwhile (unix(7) is silent
  // about it; unix_bind of the kernel does).
  if (fchmod(listening.get(), 0600) != 0 || bind(listening.get(), generic, sizeof(name)) != 0 ||
      listen(listening.get(), kBacklog) != 0) {
    return CannotListen(address, errno);
  }
  return ListeningSocket{std::move(listening), address.kind, address.text, address.path};
}

std::string WithPort(const ListenAddress& address, int socket) {
  sockaddr_storage name{};
  socklen_t size = sizeof(name);
  getsockname(socket, reinterpret_cast<sockaddr*>(&name), &size);
  const in_port_t port = name.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(name).sin6_port
                                                    : reinterpret_cast<const sockaddr_in&>(name).sin_port;
  return absl::StrCat(address.text.substr(0, address.text.rfind(':')), ":", ntohs(port));
}

}  // namespace

absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text) {
  if (absl::StartsWith(text, kUnixPrefix)) return ParseUnixSocket(text);
  ListenAddress address;
  address.text = text;
  const size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0 || !absl::SimpleAtoi(text.substr(colon + 1), &address.port) ||
      address.port < 0 || address.port > 65535) {
    return WrongListen(text, "is not HOST:PORT or unix:PATH, for example 127.0.0.1:7411");
  }
  address.host = text.substr(0, colon);
  if (absl::StartsWith(address.host, "[") && absl::EndsWith(address.host, "]"))
    address.host = address.host.substr(1, address.host.size() - 2);
  WEFT_ASSIGN_OR_RETURN(const Addresses found, AddressesOf(address));
  address.kind = ListenKind::kLoopback;
  for (const addrinfo* one = found.get(); one != nullptr; one = one->ai_next) {
    if (!IsLoopback(*one->ai_addr)) address.kind = ListenKind::kNetwork;
  }
  return address;
}

absl::StatusOr<ListeningSocket> ListenAt(const ListenAddress& address) {
  if (address.kind == ListenKind::kUnixSocket) return ListenAtPath(address);
  WEFT_ASSIGN_OR_RETURN(const Addresses found, AddressesOf(address));
  int error = EADDRNOTAVAIL;
  for (const addrinfo* one = found.get(); one != nullptr; one = one->ai_next) {
    UniqueFd listening(socket(one->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    // A port whose connections are still closing may be taken again; one that another program listens on may
    // not.
    const int yes = 1;
    setsockopt(listening.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    if (listening.open() && bind(listening.get(), one->ai_addr, one->ai_addrlen) == 0 &&
        listen(listening.get(), kBacklog) == 0) {
      std::string text = WithPort(address, listening.get());
      return ListeningSocket{std::move(listening), address.kind, std::move(text), ""};
    }
    error = errno;
  }
  return CannotListen(address, error);
}

}  // namespace weft
