// A network between client and daemon that breaks: TCP connections through a port of its own, which it cuts.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "services/formats/files/atomic_file.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

class CuttingProxy {
 public:
  // `server` is 127.0.0.1:PORT.
  explicit CuttingProxy(const std::string& server)
      : server_port_(static_cast<uint16_t>(std::stoi(server.substr(server.find(':') + 1)))),
        listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    signal(SIGPIPE, SIG_IGN);  // whoever is written to may have gone
    sockaddr_in address = Loopback(0);
    socklen_t size = sizeof(address);
    EXPECT_EQ(bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(listener_.get(), 8), 0);
    EXPECT_EQ(getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    thread_ = std::thread([this] { Run(); });
  }
  ~CuttingProxy() {
    stop_ = true;
    thread_.join();
  }
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  const std::string& address() const { return address_; }
  // Each connection is cut after so many more bytes from the server; negative: none is.
  void CutAfter(int64_t bytes) { cut_after_ = bytes; }
  // The same for bytes from the client.
  void CutAfterSent(int64_t bytes) { cut_after_sent_ = bytes; }
  // From now on nothing of what the server says arrives.
  void Hold(bool hold) { hold_ = hold; }
  // Cuts the connection that is open.
  void Cut() { cut_ = true; }

  int connections() const { return connections_; }
  int64_t bytes_from_server() const { return bytes_from_server_; }

 private:
  static sockaddr_in Loopback(uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }

  // One connection at a time, which is what a channel has.
  void Run() {
    while (!stop_) {
      pollfd waiting = {listener_.get(), POLLIN, 0};
      if (poll(&waiting, 1, 20) <= 0) continue;
      const UniqueFd client(accept(listener_.get(), nullptr, nullptr));
      const UniqueFd server(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
      const sockaddr_in address = Loopback(server_port_);
      if (connect(server.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) continue;
      ++connections_;
      Forward(client.get(), server.get());
    }
  }

  void Forward(int client, int server) {
    int64_t bytes[2] = {0, 0};  // from client and server
    char data[16384];
    while (!stop_ && !cut_.exchange(false)) {
      pollfd ends[] = {{client, POLLIN, 0}, {server, static_cast<short>(hold_ ? 0 : POLLIN), 0}};
      if (poll(ends, 2, 20) <= 0) continue;
      for (int i = 0; i < 2; ++i) {
        if (!(ends[i].revents & (POLLIN | POLLHUP | POLLERR))) continue;
        const ssize_t n = read(ends[i].fd, data, sizeof(data));
        if (n <= 0) return;
        if (WriteAll(ends[1 - i].fd, {data, static_cast<size_t>(n)}) != 0) return;
        bytes[i] += n;
        if (i == 1) bytes_from_server_ += n;
        const int64_t limit = i == 0 ? cut_after_sent_ : cut_after_;
        if (limit >= 0 && bytes[i] >= limit) return;
      }
    }
  }

  const uint16_t server_port_;
  const UniqueFd listener_;
  std::string address_;
  std::atomic<int64_t> cut_after_ = -1, cut_after_sent_ = -1, bytes_from_server_ = 0;
  std::atomic<bool> hold_ = false, cut_ = false, stop_ = false;
  std::atomic<int> connections_ = 0;
  std::thread thread_;
};

}  // namespace weft
