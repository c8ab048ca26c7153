#include "services/server/access/access_control.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/host_clock.h"
#include "services/server/access/access_list.h"
#include "services/server/access/file_stamp.h"
#include "services/server/access/methods.h"
#include "services/server/access/role_words.h"

namespace weft {
namespace {

constexpr int64_t kLookEvery_ns = 500'000'000;

absl::Status Unknown(const std::string& what) {
  return absl::UnauthenticatedError(
      absl::StrCat(what, "; ask the daemon's administrator for a token (`weft access token`)"));
}

}  // namespace

AccessControl::AccessControl(std::string path, Warn warn, Clock clock)
    : path_(std::move(path)),
      warn_(std::move(warn)),
      clock_(clock ? std::move(clock) : Clock(HostTime_ns)),
      known_(std::make_shared<Known>()) {}

std::shared_ptr<const AccessControl::Known> AccessControl::Current() {
  const MutexLock lock(mutex_);
  const int64_t now_ns = clock_();
  if (!stamp_.empty() && now_ns >= looked_ns_ && now_ns - looked_ns_ < kLookEvery_ns) return known_;
  looked_ns_ = now_ns;
  std::string stamp = FileStamp(path_);
  if (stamp == stamp_) return known_;
  stamp_ = std::move(stamp);
  auto known = std::make_shared<Known>();
  const absl::StatusOr<v1::AccessList> list = ReadAccessList(path_);
  if (list.ok()) {
    for (const v1::Token& token : list->tokens()) known->tokens[token.sha256()] = token;
    for (const v1::CertificateOwner& owner : list->certificates())
      known->certificates[owner.common_name()] = owner.role();
  } else {
    warn_(absl::StrCat(list.status().message(), "; no token or certificate is accepted until then"));
  }
  known_ = std::move(known);
  return known_;
}

absl::StatusOr<Caller> AccessControl::Identify(const Credentials& credentials) {
  const std::shared_ptr<const Known> known = Current();
  if (!credentials.token.empty() || !credentials.token_sha256.empty()) {
    const auto token = known->tokens.find(credentials.token.empty() ? credentials.token_sha256
                                                                    : HashOfToken(credentials.token));
    if (token == known->tokens.end()) return Unknown("this token is unknown or was revoked");
    const v1::Token& found = token->second;
    Caller caller{absl::StrCat("token ", found.id(), " (", found.name(), ")"), found.role()};
    if (found.expires_unix_ns() != 0 && clock_() >= found.expires_unix_ns()) {
      return Unknown(absl::StrCat(caller.name, " expired at ",
                                  absl::FormatTime(absl::FromUnixNanos(found.expires_unix_ns()))));
    }
    return caller;
  }
  if (!credentials.certificate_owner.empty()) {
    const auto owner = known->certificates.find(credentials.certificate_owner);
    if (owner != known->certificates.end())
      return Caller{absl::StrCat("certificate ", owner->first), owner->second};
    return Unknown("the owner of this certificate has no role here");
  }
  if (!credentials.local_user.empty())
    return Caller{absl::StrCat("user ", credentials.local_user), v1::ROLE_ADMIN};
  return Unknown("this daemon asks for a token or a certificate");
}

absl::Status CheckMayCall(const Caller& caller, const std::string& method) {
  const v1::Role role = MethodOf(method).role;
  if (caller.role >= role) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat(method, " asks for the role ", RoleWord(role), "; ",
                                                  caller.name, " has the role ", RoleWord(caller.role)));
}

}  // namespace weft
