// Where a daemon listens.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// kConsole: no address; the console of this process connects.
enum class ListenKind { kUnixSocket, kLoopback, kNetwork, kConsole };

struct ListenAddress {
  ListenKind kind = ListenKind::kUnixSocket;
  std::string text;  // "unix:/run/weft/weftd.sock", "127.0.0.1:7411" or "[::1]:7411"
  std::string path;  // of a socket
  std::string host;  // without brackets
  int port = 0;
};

// From "unix:PATH" or "HOST:PORT"; names of hosts are looked up. InvalidArgument names --listen: neither, a
// path that is relative or too long for a socket, or a host that is unknown.
absl::StatusOr<ListenAddress> ParseListenAddress(const std::string& text);

struct ListeningSocket {
  UniqueFd socket;
  ListenKind kind = ListenKind::kUnixSocket;
  std::string address;  // with the port that was chosen
  std::string path;     // of a socket of the file system
};

// A socket of the file system is closed to other users; one that a daemon left behind is replaced.
// FailedPrecondition names the address: it is in use, or none of this machine's.
absl::StatusOr<ListeningSocket> ListenAt(const ListenAddress& address);

}  // namespace weft
