// Who a caller is, and what the caller may do.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/callers/caller.h"
#include "weft/v1/access.pb.h"

namespace weft {

// What a call shows of its caller.
struct Credentials {
  // Users of this machine whose connection the kernel vouches for: the user that the daemon runs as, or root.
  std::string local_user;
  std::string token;              // without "Bearer "
  std::string certificate_owner;  // common name of a certificate that was verified
  std::string token_sha256;  // of a token that was shown before, from who keeps its hash; counts as the token
};

// Knows access.json, and takes its changes. A list that cannot be read keeps all tokens and certificates out
// until it can, which `warn` is told once. Thread safety: any thread.
class AccessControl {
 public:
  using Clock = std::function<int64_t()>;  // ns since 1970
  using Warn = std::function<void(const std::string& message)>;

  AccessControl(std::string path, Warn warn, Clock clock = {});

  // A token counts before a certificate, and that before the local user: what a client shows is what it wants
  // to be. Unauthenticated: nothing is shown, or a token or certificate that is unknown or expired; the
  // message says what to do.
  absl::StatusOr<Caller> Identify(const Credentials& credentials);

 private:
  struct Known {
    std::map<std::string, v1::Token> tokens;  // by hash
    std::map<std::string, v1::Role> certificates;
  };

  std::shared_ptr<const Known> Current();

  const std::string path_;
  const Warn warn_;
  const Clock clock_;
  Mutex mutex_;
  std::string stamp_ ABSL_GUARDED_BY(mutex_);  // of the file that was read last
  int64_t looked_ns_ ABSL_GUARDED_BY(mutex_) = 0;
  std::shared_ptr<const Known> known_ ABSL_GUARDED_BY(mutex_);
};

// PermissionDenied names the method, the role that it asks for, and the caller's.
absl::Status CheckMayCall(const Caller& caller, const std::string& method);

}  // namespace weft
