// access.json: the tokens and certificates that a daemon knows.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/access.pb.h"

namespace weft {

std::string AccessListFile(const std::string& state_folder);

// Empty where there is no file. PermissionDenied: other users may write it. Otherwise errors of ReadJsonFile.
absl::StatusOr<v1::AccessList> ReadAccessList(const std::string& path);

// Of a token's text, as Token.sha256 has it.
std::string HashOfToken(const std::string& text);

struct NewToken {
  std::string text;  // for its owner; kept nowhere
  v1::Token token;
};

struct TokenRequest {
  std::string name;  // whose it will be
  v1::Role role = v1::ROLE_UNSPECIFIED;
  double days = 0;  // until it expires; 0: never
};

// The functions below change the file, one process at a time; a daemon that runs takes the change within a
// second. Errors of ReadAccessList and WriteFileAtomically besides.

// InvalidArgument: no name that CheckItemName accepts, no role, or negative days.
absl::StatusOr<NewToken> AddToken(const std::string& path, const TokenRequest& request);
// Replaces the role of a name that is known. InvalidArgument: no name, or no role.
absl::Status AllowCertificate(const std::string& path, const std::string& common_name, v1::Role role);
// By the id of a token or the name of a certificate's owner. NotFound: neither.
absl::Status RevokeAccess(const std::string& path, const std::string& id_or_name);

}  // namespace weft
