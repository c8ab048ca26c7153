#include "services/server/daemon/door/call_identity.h"

#include <grpc/grpc_security_constants.h>

#include <vector>

#include "absl/strings/match.h"

namespace weft {
namespace {

constexpr char kPeer[] = "weft_peer";
constexpr char kTrustedUser[] = "weft_user";
constexpr char kConsole[] = "weft_console";

std::string TokenOf(const CallMetadata& metadata) {
  constexpr absl::string_view kScheme = "bearer ";
  const std::string value = ValueOf(metadata, "authorization");
  return absl::StartsWithIgnoreCase(value, kScheme) ? value.substr(kScheme.size()) : value;
}

}  // namespace

std::string ValueOf(const CallMetadata& metadata, const char* name) {
  const auto found = metadata.find(name);
  return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
}

std::string PropertyOf(const grpc::AuthContext& context, const char* name) {
  const std::vector<grpc::string_ref> values = context.FindPropertyValues(name);
  return values.empty() ? "" : std::string(values[0].data(), values[0].size());
}

void NotePeer(const std::string& name, const std::string& trusted_user, grpc::AuthContext* context) {
  context->AddProperty(kPeer, name);
  if (!trusted_user.empty()) context->AddProperty(kTrustedUser, trusted_user);
}

void NoteConsole(grpc::AuthContext* context) { context->AddProperty(kConsole, "yes"); }

std::string PeerNameOf(const grpc::AuthContext& context) { return PropertyOf(context, kPeer); }

Credentials CredentialsOf(const CallMetadata& metadata, const grpc::AuthContext& context) {
  Credentials credentials;
  credentials.local_user = PropertyOf(context, kTrustedUser);
  credentials.token = TokenOf(metadata);
  if (!PropertyOf(context, kConsole).empty())
    credentials.token_sha256 = ValueOf(metadata, "weft-token-sha256");
  credentials.certificate_owner = PropertyOf(context, GRPC_X509_CN_PROPERTY_NAME);
  return credentials;
}

}  // namespace weft
