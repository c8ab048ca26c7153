#include "services/tools/client/connection_fault.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <signal.h>
#include <sys/socket.h>

#include <thread>

#include "absl/strings/str_cat.h"
#include "services/ground/process/unique_fd.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/access/certificate_maker.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// Answers one connection on 127.0.0.1: with TLS where it has a certificate, in plain HTTP where it has none.
class OneAnswer {
 public:
  explicit OneAnswer(const CertificateFiles& files)
      : listening_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t bytes = sizeof address;
    EXPECT_EQ(bind(listening_.get(), reinterpret_cast<sockaddr*>(&address), bytes), 0);
    EXPECT_EQ(listen(listening_.get(), 1), 0);
    getsockname(listening_.get(), reinterpret_cast<sockaddr*>(&address), &bytes);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this, files] { Serve(files); });
  }
  std::string At(const std::string& host) const { return absl::StrCat(host, ":", port_); }

 private:
  void Serve(const CertificateFiles& files) const {
    // The client is gone when OpenSSL sends its tickets.
    sigset_t pipe;
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
    const UniqueFd fd(accept(listening_.get(), nullptr, nullptr));
    if (files.certificate.empty()) {
      constexpr char kAnswer[] = "HTTP/1.1 400 Bad Request\r\n\r\n";
      EXPECT_GT(send(fd.get(), kAnswer, sizeof kAnswer - 1, MSG_NOSIGNAL), 0);
      return;
    }
    const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_server_method()),
                                                                    &SSL_CTX_free);
    EXPECT_EQ(SSL_CTX_use_certificate_file(context.get(), files.certificate.c_str(), SSL_FILETYPE_PEM), 1);
    EXPECT_EQ(SSL_CTX_use_PrivateKey_file(context.get(), files.key.c_str(), SSL_FILETYPE_PEM), 1);
    const std::unique_ptr<SSL, decltype(&SSL_free)> session(SSL_new(context.get()), &SSL_free);
    SSL_set_fd(session.get(), fd.get());
    SSL_accept(session.get());
    char byte = 0;
    SSL_read(session.get(), &byte, 1);  // until the client has looked
  }

  UniqueFd listening_;
  int port_ = 0;
  std::jthread thread_;
};

class ConnectionFault : public ::testing::Test {
 protected:
  std::string Find(const CertificateFiles& files, const std::string& host = "127.0.0.1") {
    const OneAnswer server(files);
    return FindConnectionFault(server.At(host), identity_);
  }

  TempFolder folder_;
  CertificateMaker maker_{folder_.path(), "studio"};
  ClientIdentity identity_{"", maker_.authority(), "", ""};
};

TEST_F(ConnectionFault, NoneWhereAllIsRight) {
  EXPECT_EQ(Find(maker_.Sign("weftd")), "");
  EXPECT_EQ(Find(maker_.Sign("weftd"), "localhost"), "");
  identity_.authority.clear();
  EXPECT_EQ(Find({}), "");
}

TEST_F(ConnectionFault, OfACertificateIsNamed) {
  EXPECT_THAT(Find(maker_.Sign("old", 5, "IP:127.0.0.1", -10)), HasSubstr("expired on"));
  EXPECT_THAT(Find(maker_.Sign("coming", 5, "IP:127.0.0.1", 2)), HasSubstr("compare the clocks"));
  EXPECT_THAT(Find(maker_.Sign("other", 30, "DNS:vm.studio.example")),
              HasSubstr("is for vm.studio.example, not for 127.0.0.1"));
  identity_.authority = CertificateMaker(folder_.path(), "another").authority();
  EXPECT_THAT(Find(maker_.Sign("weftd")), HasSubstr("set WEFT_TLS_CA"));
}

TEST_F(ConnectionFault, OfTlsOnOneSideAloneIsNamed) {
  EXPECT_THAT(Find({}), HasSubstr("speaks no TLS"));
  identity_.authority.clear();
  EXPECT_THAT(Find(maker_.Sign("weftd")), HasSubstr("speaks TLS; set WEFT_TLS_CA"));
}

TEST_F(ConnectionFault, NoneWhereNothingListens) {
  EXPECT_EQ(FindConnectionFault("127.0.0.1:1", identity_), "");
  EXPECT_EQ(FindConnectionFault("unix:/nowhere", identity_), "");
  EXPECT_EQ(FindConnectionFault("nowhere", identity_), "");
}

TEST(OpenChannel, AddressesOfPagesAreNone) {
  const auto opened = OpenChannel("http://127.0.0.1:7411", {});
  EXPECT_THAT(std::string(opened.status().message()), HasSubstr("give \"127.0.0.1:7411\""));
}

// A name that begins like an address of this machine may be anybody's.
TEST(UsesTls, WhateverLeavesThisMachineDoes) {
  for (const char* here : {"localhost", "[::1]", "127.0.0.1", "127.8.0.9"})
    EXPECT_FALSE(UsesTls(here, {})) << here;
  for (const char* there : {"127.0.0.evil.example", "127.example", "10.0.0.1", "studio"})
    EXPECT_TRUE(UsesTls(there, {})) << there;
  EXPECT_TRUE(UsesTls("127.0.0.1", {"", "ca.pem", "", ""}));
}

TEST_F(ConnectionFault, MessagesSayWhatToDo) {
  EXPECT_THAT(
      Find(maker_.Sign("old", 5, "IP:127.0.0.1", -10)),
      testing::MatchesRegex("its certificate expired on [A-Z][a-z][a-z] .* GMT; renew the file of weftd "
                            "--tls-cert there"));
  EXPECT_THAT(
      Find(maker_.Sign("coming", 5, "IP:127.0.0.1", 2)),
      testing::MatchesRegex("its certificate is valid from [A-Z][a-z][a-z] .* GMT on; compare the clocks of "
                            "both machines"));
  EXPECT_EQ(
      Find(maker_.Sign("many", 30, "DNS:vm.studio.example,IP:10.0.0.7,DNS:b.example")),
      "its certificate is for vm.studio.example, an address, b.example, not for 127.0.0.1; connect by a name "
      "that it has, or have it made for this one, too");
  EXPECT_EQ(Find(maker_.Sign("address", 30, "IP:127.0.0.1"), "localhost"),
            "its certificate is for an address, not for localhost; connect by a name that it has, or have it "
            "made for "
            "this one, too");
  EXPECT_EQ(Find({}),
            "what listens there speaks no TLS; start weftd there with --tls-cert and --tls-key, or unset "
            "WEFT_TLS_CA where both run on one machine");
  identity_.authority.clear();
  EXPECT_EQ(Find(maker_.Sign("weftd")),
            "what listens there speaks TLS; set WEFT_TLS_CA to the certificate of its authority");
}

TEST_F(ConnectionFault, SignalsOfThisThreadStayAsTheyWere) {
  sigset_t before, after;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  EXPECT_EQ(Find(maker_.Sign("weftd")), "");
  pthread_sigmask(SIG_SETMASK, nullptr, &after);
  EXPECT_EQ(sigismember(&before, SIGPIPE), 0);
  EXPECT_EQ(sigismember(&after, SIGPIPE), 0);
}

}  // namespace
}  // namespace weft
