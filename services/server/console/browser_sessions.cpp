#include "services/server/console/browser_sessions.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/escaping.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/access/access_list.h"
#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

constexpr int kIdBytes = 32;
constexpr size_t kIdDigits = 2 * kIdBytes;
constexpr double kMostFailures = 10, kFailures_per_s = 1.0 / 6;
constexpr size_t kMostPeers = 1000;
constexpr std::chrono::milliseconds kRetry{6000};

absl::Status Gone() {
  return absl::UnauthenticatedError("this browser is not logged in, or no longer; log in with a token");
}

}  // namespace

BrowserSessions::BrowserSessions(std::string path, AccessControl& access, Clock clock)
    : path_(std::move(path)), access_(access), clock_(clock ? std::move(clock) : Clock(HostTime_ns)) {
  if (!ReadJsonFile(path_, sessions_).ok()) sessions_.Clear();
}

bool BrowserSessions::MayTry(const std::string& peer, int64_t now_ns) {
  if (failures_.size() > kMostPeers) failures_.clear();
  const auto [entry, is_new] = failures_.try_emplace(peer);
  Failures& failures = entry->second;
  const double passed_s = static_cast<double>(now_ns - failures.counted_ns) / 1e9;
  failures.left =
      is_new ? kMostFailures : std::min(kMostFailures, failures.left + kFailures_per_s * passed_s);
  failures.counted_ns = now_ns;
  return failures.left >= 1;
}

void BrowserSessions::Drop(size_t index) {
  const auto& sessions = sessions_.sessions();
  sessions_.mutable_sessions()->erase(sessions.begin() + static_cast<int>(index));
}

void BrowserSessions::MakeRoom(const std::string& token_sha256) {
  const int64_t now_ns = clock_();
  auto& sessions = *sessions_.mutable_sessions();
  sessions.erase(std::remove_if(sessions.begin(), sessions.end(),
                                [&](const auto& one) { return now_ns >= one.expires_unix_ns(); }),
                 sessions.end());
  const auto is_same = [&](const auto& one) { return one.token_sha256() == token_sha256; };
  if (static_cast<size_t>(std::ranges::count_if(sessions, is_same)) >= kMostOfOneToken)
    sessions.erase(std::ranges::find_if(sessions, is_same));
  if (static_cast<size_t>(sessions.size()) >= kMost) Drop(0);
}

void BrowserSessions::Save() {
  const absl::StatusOr<std::string> text = ToJson(sessions_);
  // Where the disk is full, browsers show their tokens again after the daemon's next start.
  if (text.ok()) (void)WriteFileAtomically(path_, *text, 0600);
}

absl::StatusOr<BrowserSessions::Begun> BrowserSessions::Begin(const std::string& token,
                                                              const std::string& peer) {
  const int64_t now_ns = clock_();
  {
    const MutexLock lock(mutex_);
    if (!MayTry(peer, now_ns))
      return RetryLater(absl::StatusCode::kResourceExhausted, "too many wrong tokens came from here", kRetry);
  }
  if (token.empty()) return absl::UnauthenticatedError("token: it is missing");
  absl::StatusOr<Caller> caller = access_.Identify({.token = token});
  const MutexLock lock(mutex_);
  if (!caller.ok()) {
    --failures_[peer].left;
    return caller.status();
  }
  std::array<char, kIdBytes> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != kIdBytes)
    return absl::UnavailableError("the kernel gave no random numbers for a session");
  Begun begun;
  begun.id = absl::BytesToHexString({bytes.data(), bytes.size()});
  begun.session = {HashOfToken(begun.id), HashOfToken(token), *std::move(caller),
                   now_ns + std::chrono::nanoseconds(kLasts).count()};
  MakeRoom(begun.session.token_sha256);
  v1::ConsoleSession& kept = *sessions_.add_sessions();
  kept.set_id_sha256(begun.session.id_sha256);
  kept.set_token_sha256(begun.session.token_sha256);
  kept.set_expires_unix_ns(begun.session.expires_unix_ns);
  Save();
  return begun;
}

absl::StatusOr<BrowserSession> BrowserSessions::Find(const std::string& id) {
  if (id.size() != kIdDigits) return Gone();
  BrowserSession session;
  session.id_sha256 = HashOfToken(id);
  {
    const MutexLock lock(mutex_);
    const auto& sessions = sessions_.sessions();
    const auto found = std::ranges::find_if(
        sessions, [&](const v1::ConsoleSession& one) { return one.id_sha256() == session.id_sha256; });
    if (found == sessions.end() || clock_() >= found->expires_unix_ns()) return Gone();
    session.token_sha256 = found->token_sha256();
    session.expires_unix_ns = found->expires_unix_ns();
  }
  WEFT_ASSIGN_OR_RETURN(session.caller, access_.Identify({.token_sha256 = session.token_sha256}));
  return session;
}

void BrowserSessions::End(const std::string& id) {
  const std::string hash = HashOfToken(id);
  const MutexLock lock(mutex_);
  for (int i = 0; i < sessions_.sessions_size(); ++i) {
    if (sessions_.sessions(i).id_sha256() != hash) continue;
    Drop(static_cast<size_t>(i));
    Save();
    return;
  }
}

}  // namespace weft
