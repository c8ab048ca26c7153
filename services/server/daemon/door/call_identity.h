// Who makes a call, as its connection and its metadata show it.
#pragma once

#include <grpcpp/security/auth_context.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/string_ref.h>

#include <functional>
#include <map>
#include <string>

#include "services/server/access/access_control.h"

namespace weft {

// Of a call that was let in; without a name where it is nobody's (health).
using FindCaller = std::function<Caller(const grpc::ServerContextBase& context)>;

using CallMetadata = std::multimap<grpc::string_ref, grpc::string_ref>;

// Empty where there is none.
std::string ValueOf(const CallMetadata& metadata, const char* name);
// The first value of a property.
std::string PropertyOf(const grpc::AuthContext& context, const char* name);

// The connection's other end becomes properties of its context, which all its calls share: once, before its
// first call is looked at. `trusted_user` may be empty.
void NotePeer(const std::string& name, const std::string& trusted_user, grpc::AuthContext* context);
// Calls of the connection are the console's, which may name tokens by their hashes.
void NoteConsole(grpc::AuthContext* context);
// Empty: it was not noted.
std::string PeerNameOf(const grpc::AuthContext& context);

// What the call shows, of a connection whose peer was noted.
Credentials CredentialsOf(const CallMetadata& metadata, const grpc::AuthContext& context);

}  // namespace weft
