// An HTTP server on this machine that answers every request alike, and keeps what it was asked.
#pragma once

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/ground/process/unique_fd.h"
#include "tests/services/server/access/certificate_maker.h"

namespace weft {

class AnsweringServer {
 public:
  // `answer` as it goes over the wire; empty: none is given while this lives. With a certificate by TLS.
  explicit AnsweringServer(std::string answer, const CertificateFiles& certificate = {})
      : answer_(std::move(answer)),
        tls_(nullptr, &SSL_CTX_free),
        listening_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (!certificate.certificate.empty()) {
      tls_.reset(SSL_CTX_new(TLS_server_method()));
      EXPECT_EQ(SSL_CTX_use_certificate_file(tls_.get(), certificate.certificate.c_str(), SSL_FILETYPE_PEM),
                1);
      EXPECT_EQ(SSL_CTX_use_PrivateKey_file(tls_.get(), certificate.key.c_str(), SSL_FILETYPE_PEM), 1);
    }
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t bytes = sizeof address;
    EXPECT_EQ(bind(listening_.get(), reinterpret_cast<sockaddr*>(&address), bytes), 0);
    EXPECT_EQ(listen(listening_.get(), 16), 0);
    EXPECT_EQ(getsockname(listening_.get(), reinterpret_cast<sockaddr*>(&address), &bytes), 0);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { Serve(); });
  }
  ~AnsweringServer() {
    shutdown(listening_.get(), SHUT_RDWR);
    thread_.join();
  }

  int port() const { return port_; }
  // "http://127.0.0.1:PORT/path".
  std::string Url(const std::string& path) const {
    return absl::StrCat(tls_ ? "https" : "http", "://127.0.0.1:", port_, path);
  }
  // Whole requests, in order.
  std::vector<std::string> Asked() {
    const std::lock_guard lock(mutex_);
    return asked_;
  }

 private:
  using Receive = std::function<int(char* bytes, int size)>;

  void Serve() {
    // OpenSSL writes to clients that have gone.
    sigset_t broken;
    sigemptyset(&broken);
    sigaddset(&broken, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &broken, nullptr);
    std::vector<UniqueFd> silent;
    while (true) {
      UniqueFd connection(accept(listening_.get(), nullptr, nullptr));
      if (!connection.open()) return;
      if (tls_) {
        const std::unique_ptr<SSL, decltype(&SSL_free)> tls(SSL_new(tls_.get()), &SSL_free);
        SSL_set_fd(tls.get(), connection.get());
        if (SSL_accept(tls.get()) != 1) continue;
        Keep([&](char* bytes, int size) { return SSL_read(tls.get(), bytes, size); });
        SSL_write(tls.get(), answer_.data(), static_cast<int>(answer_.size()));
        SSL_shutdown(tls.get());
        continue;
      }
      Keep([&](char* bytes, int size) {
        return static_cast<int>(recv(connection.get(), bytes, static_cast<size_t>(size), 0));
      });
      (void)send(connection.get(), answer_.data(), answer_.size(), MSG_NOSIGNAL);
      if (answer_.empty()) silent.push_back(std::move(connection));
    }
  }
  // A request with its body.
  void Keep(const Receive& receive) {
    std::string all;
    size_t wanted = std::string::npos;
    char bytes[4096];
    while (all.size() < wanted) {
      const int got = receive(bytes, sizeof bytes);
      if (got <= 0) break;
      all.append(bytes, static_cast<size_t>(got));
      const size_t end = all.find("\r\n\r\n"), length = all.find("Content-Length: ");
      if (end == std::string::npos) continue;
      wanted = end + 4 + (length < end ? std::strtoul(all.c_str() + length + 16, nullptr, 10) : 0);
    }
    const std::lock_guard lock(mutex_);
    asked_.push_back(std::move(all));
  }

  const std::string answer_;
  std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> tls_;
  const UniqueFd listening_;
  int port_ = 0;
  std::mutex mutex_;
  std::vector<std::string> asked_;
  std::thread thread_;
};

}  // namespace weft
