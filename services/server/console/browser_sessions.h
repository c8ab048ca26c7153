// Browsers that showed a token.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/access/access_control.h"
#include "weft/v1/console.pb.h"

namespace weft {

struct BrowserSession {
  std::string id_sha256;     // names the session; nobody can use it
  std::string token_sha256;  // as AccessControl knows it
  Caller caller;
  int64_t expires_unix_ns = 0;
};

// A token is exchanged for a random id, which the browser keeps in a cookie. Of both only hashes are kept, in
// a file that the next daemon reads, so that browsers stay logged in. There are 200 at most, 20 of one token:
// the oldest goes. Thread safety: any thread.
class BrowserSessions {
 public:
  using Clock = std::function<int64_t()>;  // ns since 1970
  static constexpr std::chrono::hours kLasts{24};
  static constexpr size_t kMost = 200, kMostOfOneToken = 20;

  // A file that cannot be read is as none: browsers show their tokens again.
  BrowserSessions(std::string path, AccessControl& access, Clock clock = {});

  struct Begun {
    std::string id;  // for the cookie; kept nowhere
    BrowserSession session;
  };
  // Unauthenticated: the token is none. ResourceExhausted: too many wrong ones of this peer, 10 at once and
  // one in 6 s.
  absl::StatusOr<Begun> Begin(const std::string& token, const std::string& peer);
  // Unauthenticated: no such session, it or its token expired, or the token was revoked.
  absl::StatusOr<BrowserSession> Find(const std::string& id);
  void End(const std::string& id);

 private:
  struct Failures {
    double left = 0;
    int64_t counted_ns = 0;
  };
  void Drop(size_t index) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void MakeRoom(const std::string& token_sha256) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Save() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool MayTry(const std::string& peer, int64_t now_ns) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string path_;
  AccessControl& access_;
  const Clock clock_;
  Mutex mutex_;
  v1::ConsoleSessions sessions_ ABSL_GUARDED_BY(mutex_);  // oldest first
  std::map<std::string, Failures> failures_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
