// The console of a daemon in this process, asked byte by byte.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/access/access_list.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {

class ConsoleTest : public DaemonTest {
 protected:
  ConsoleTest() {
    options_.console_listen = "127.0.0.1:0";
    options_.console_files = folder_ / "pages";
    WriteBytes(folder_ / "pages/index.html", "<!doctype html>" + std::string(1000, 'x'));
    WriteBytes(folder_ / "pages/assets/main-1a2b3c4d.js", "1;");
    std::filesystem::create_directories(options_.state_folder);
    for (const v1::Role role : {v1::ROLE_VIEWER, v1::ROLE_CLIENT, v1::ROLE_ADMIN})
      tokens_[role] = AddToken(AccessListFile(options_.state_folder), {"anna", role, 0}).value().text;
    StartConsole();
  }
  void StartConsole() {
    StartDaemon();
    const std::string& address = daemon_->console_address();
    port_ = std::stoi(address.substr(address.rfind(':') + 1));
  }
  std::string TokenOf(v1::Role role) const { return tokens_.at(role); }
  UniqueFd Connect() const {
    UniqueFd connection(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience = {20, 0};
    setsockopt(connection.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(connect(connection.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return connection;
  }
  static void Send(const UniqueFd& connection, const std::string& bytes) {
    (void)send(connection.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  // Until `end` was read, or the other side ended it.
  static std::string Receive(const UniqueFd& connection, const std::string& end = "") {
    std::string all;
    char bytes[4096];
    while (end.empty() || all.find(end) == std::string::npos) {
      const ssize_t n = recv(connection.get(), bytes, sizeof bytes, 0);
      if (n <= 0) break;
      all.append(bytes, static_cast<size_t>(n));
    }
    return all;
  }
  std::string Ask(const std::string& request) const {
    const UniqueFd connection = Connect();
    Send(connection, request);
    return Receive(connection);
  }
  std::string Headers(const std::string& more = "") const {
    return absl::StrCat("Host: 127.0.0.1:", port_, "\r\nConnection: close\r\n",
                        cookie_.empty() ? "" : absl::StrCat("Cookie: ", cookie_, "\r\n"), more);
  }
  std::string Origin() const { return absl::StrCat("Origin: http://127.0.0.1:", port_, "\r\n"); }
  // Whole, with its headers by name.
  struct Reply {
    std::string status, body;
    std::map<std::string, std::string> headers;
  };
  static Reply Parsed(const std::string& answer) {
    Reply reply;
    const size_t end = answer.find("\r\n\r\n");
    std::vector<std::string> lines = absl::StrSplit(answer.substr(0, end), "\r\n");
    reply.status = lines[0];
    for (size_t i = 1; i < lines.size(); ++i) {
      const std::pair<std::string, std::string> parts = absl::StrSplit(lines[i], absl::MaxSplits(": ", 1));
      reply.headers.insert(parts);
    }
    if (end != std::string::npos) reply.body = answer.substr(end + 4);
    return reply;
  }
  std::string Get(const std::string& path, const std::string& more = "") const {
    return Ask(absl::StrCat("GET ", path, " HTTP/1.1\r\n", Headers(more), "\r\n"));
  }
  std::string Post(const std::string& path, const std::string& body) const {
    return Ask(absl::StrCat("POST ", path, " HTTP/1.1\r\n", Headers(Origin()),
                            "Content-Type: application/json\r\nContent-Length: ", body.size(), "\r\n\r\n",
                            body));
  }
  std::string LogIn(const std::string& token) {
    const std::string answer = Post("/login", absl::StrCat("{\"token\": \"", token, "\"}"));
    const size_t at = answer.find("Set-Cookie: ");
    if (at != std::string::npos) cookie_ = answer.substr(at + 12, answer.find(';', at) - at - 12);
    return answer;
  }

  std::map<v1::Role, std::string> tokens_;
  int port_ = 0;
  std::string cookie_;
};

}  // namespace weft
