#include "services/server/daemon/door/call_identity.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

namespace weft {
namespace {

class NoProperties final : public grpc::AuthPropertyIterator {};

// As gRPC's own: properties with several values each.
class PlayedAuthContext final : public grpc::AuthContext {
 public:
  bool IsPeerAuthenticated() const override { return false; }
  std::vector<grpc::string_ref> GetPeerIdentity() const override { return {}; }
  std::string GetPeerIdentityPropertyName() const override { return ""; }
  std::vector<grpc::string_ref> FindPropertyValues(const std::string& name) const override {
    std::vector<grpc::string_ref> values;
    const auto [begin, end] = properties_.equal_range(name);
    for (auto it = begin; it != end; ++it) values.emplace_back(it->second);
    return values;
  }
  grpc::AuthPropertyIterator begin() const override { return NoProperties(); }
  grpc::AuthPropertyIterator end() const override { return NoProperties(); }
  void AddProperty(const std::string& key, const grpc::string_ref& value) override {
    properties_.emplace(key, std::string(value.data(), value.size()));
  }
  bool SetPeerIdentityPropertyName(const std::string&) override { return false; }

 private:
  std::multimap<std::string, std::string> properties_;
};

TEST(CallIdentity, TakesATokenWithOrWithoutItsScheme) {
  const PlayedAuthContext context;
  EXPECT_EQ(CredentialsOf({{"authorization", "Bearer abc"}}, context).token, "abc");
  EXPECT_EQ(CredentialsOf({{"authorization", "bearer abc"}}, context).token, "abc");
  EXPECT_EQ(CredentialsOf({{"authorization", "abc"}}, context).token, "abc");
  EXPECT_EQ(CredentialsOf({}, context).token, "");
}

// Else a client could name the hash of a token that it does not have.
TEST(CallIdentity, TakesHashesOfTokensFromTheConsoleAlone) {
  PlayedAuthContext context;
  const CallMetadata metadata = {{"weft-token-sha256", "0a1b"}};
  EXPECT_EQ(CredentialsOf(metadata, context).token_sha256, "");
  NoteConsole(&context);
  EXPECT_EQ(CredentialsOf(metadata, context).token_sha256, "0a1b");
}

TEST(CallIdentity, IsThatOfTheConnection) {
  PlayedAuthContext network, local;
  EXPECT_EQ(PeerNameOf(network), "");
  NotePeer("10.0.0.5", "", &network);
  NotePeer("user anna", "anna", &local);
  EXPECT_EQ(PeerNameOf(network), "10.0.0.5");
  EXPECT_EQ(CredentialsOf({}, network).local_user, "");
  EXPECT_EQ(CredentialsOf({}, local).local_user, "anna");
  // Metadata is the client's to write.
  EXPECT_EQ(CredentialsOf({{"weft_user", "root"}}, network).local_user, "");
}

}  // namespace
}  // namespace weft
