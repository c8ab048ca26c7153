#include "services/tools/client/channel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/capture/temp_folder.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string WhyNoChannel(const std::string& server, const ClientIdentity& identity = {}) {
  const absl::Status status = OpenChannel(server, identity).status();
  return status.ok() ? "" : std::string(status.message());
}

TEST(Channel, LeavesTheMachineInTlsAlone) {
  EXPECT_FALSE(UsesTls("127.0.0.1", {}));
  EXPECT_FALSE(UsesTls("localhost", {}));
  EXPECT_TRUE(UsesTls("studio.example", {}));
  EXPECT_TRUE(UsesTls("127.0.0.1", {.token_file = "", .authority = "ca.pem", .certificate = "", .key = ""}));
}

TEST(Channel, TakesAddressesWithPorts) {
  EXPECT_EQ(WhyNoChannel("127.0.0.1:7411"), "");
  EXPECT_EQ(WhyNoChannel("[::1]:1"), "");
  EXPECT_EQ(WhyNoChannel("studio:65535"), "");
  EXPECT_EQ(WhyNoChannel("unix:/run/weftd"), "");
  for (const char* wrong :
       {"", "127.0.0.1", ":7411", "studio:", "studio:0", "studio:65536", "studio:-1", "studio:a"}) {
    EXPECT_THAT(WhyNoChannel(wrong),
                HasSubstr(std::string("server: \"") + wrong + "\" is not HOST:PORT or unix:PATH"));
    EXPECT_TRUE(absl::IsInvalidArgument(OpenChannel(wrong, {}).status()));
  }
  EXPECT_EQ(
      WhyNoChannel("https://studio:7411"),
      "server: \"https://studio:7411\" is the address of a page; give \"studio:7411\" with the port of weftd "
      "--listen");
}

TEST(Channel, NamesTheVariableOfAFileThatIsWrong) {
  const TempFolder folder;
  EXPECT_THAT(WhyNoChannel("127.0.0.1:1",
                           {.token_file = folder / "none", .authority = "", .certificate = "", .key = ""}),
              AllOf(HasSubstr("WEFT_TOKEN_FILE"), HasSubstr("none")));
  WriteBytes(folder / "empty", " \n");
  EXPECT_THAT(WhyNoChannel("127.0.0.1:1",
                           {.token_file = folder / "empty", .authority = "", .certificate = "", .key = ""}),
              HasSubstr("is empty; put a token of `weft access token` there"));
  EXPECT_THAT(
      WhyNoChannel("studio:1", {.token_file = "", .authority = folder / "ca", .certificate = "", .key = ""}),
      HasSubstr("WEFT_TLS_CA"));
  for (const bool has_key : {false, true})
    EXPECT_EQ(WhyNoChannel("studio:1", {.token_file = "",
                                        .authority = "",
                                        .certificate = has_key ? "" : "c.pem",
                                        .key = has_key ? "k.pem" : ""}),
              "WEFT_TLS_CERT and WEFT_TLS_KEY: a certificate needs its key; set both");
  // Without TLS nobody asks for it.
  EXPECT_EQ(
      WhyNoChannel("127.0.0.1:1", {.token_file = "", .authority = "", .certificate = "c.pem", .key = ""}),
      "");
}

TEST(Channel, IdentityIsThatOfTheEnvironment) {
  const std::pair<const char*, const char*> variables[] = {
      {"WEFT_TOKEN_FILE", "/t"}, {"WEFT_TLS_CA", "/a"}, {"WEFT_TLS_CERT", "/c"}, {"WEFT_TLS_KEY", "/k"}};
  for (const auto& [name, value] : variables) setenv(name, value, 1);
  const ClientIdentity identity = ClientIdentity::FromEnvironment();
  for (const auto& [name, value] : variables) unsetenv(name);
  EXPECT_EQ(identity.token_file, "/t");
  EXPECT_EQ(identity.authority, "/a");
  EXPECT_EQ(identity.certificate, "/c");
  EXPECT_EQ(identity.key, "/k");
  EXPECT_EQ(ClientIdentity::FromEnvironment().token_file, "");
}

TEST(Channel, CallsCarryTheToken) {
  AnsweringDaemon daemon;
  EXPECT_EQ(daemon.info.authorization, "");
  const TempFolder folder;
  WriteBytes(folder / "token", " secret\n");
  const auto channel = OpenChannel(
      daemon.address(), {.token_file = folder / "token", .authority = "", .certificate = "", .key = ""});
  ASSERT_TRUE(channel.ok()) << channel.status();
  grpc::ClientContext context;
  v1::ServerInfo info;
  ASSERT_TRUE(v1::Server::NewStub(*channel)->GetServerInfo(&context, {}, &info).ok());
  EXPECT_EQ(daemon.info.authorization, "Bearer secret");
}

}  // namespace
}  // namespace weft
