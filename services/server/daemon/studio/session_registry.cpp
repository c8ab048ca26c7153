#include "services/server/daemon/studio/session_registry.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "base/timed_id.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/callers/fair_share.h"
#include "services/server/callers/owners.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/page.h"
#include "services/studio/recording/session_file.h"

namespace weft {
namespace {

constexpr double kUsualLease_s = 60, kLeastLease_s = 5, kMostLease_s = 7 * 24 * 3600;
// Operators alone open sessions, so the reserve is for administrators.
constexpr ShareLimits kOpenSessions{
    .all = 1000, .of_one_caller = 300, .reserve = 50, .reserved_for = v1::ROLE_ADMIN};
constexpr size_t kMostEndedSessions = 10'000;  // the oldest are forgotten

// 128 random bits behind the id: to know the id is not to have the session.
std::string NewLease(const std::string& id) {
  std::random_device random;
  std::string lease = absl::StrCat(id, ".");
  for (int i = 0; i < 4; ++i) absl::StrAppendFormat(&lease, "%08x", random());
  return lease;
}

absl::Status BadOpenRequest(const std::string& field, const std::string& problem, const std::string& remedy) {
  return FieldError(absl::StatusCode::kInvalidArgument, {field, problem, remedy});
}

absl::Status CheckOpenRequest(const v1::OpenSessionRequest& request) {
  WEFT_RETURN_IF_ERROR(CheckKey(request.idempotency_key()));
  if (request.owner().empty())
    return BadOpenRequest("owner", "is empty", "say who opens the session, for others to see");
  WEFT_RETURN_IF_ERROR(CheckOwner(request.owner()));
  WEFT_RETURN_IF_ERROR(CheckSession(request.cameras(), "cameras"));
  const double lease_s = request.lease_s();
  if (lease_s == 0 || (lease_s >= kLeastLease_s && lease_s <= kMostLease_s)) return absl::OkStatus();
  return BadOpenRequest(
      "lease_s", absl::StrCat(lease_s, " is out of range"),
      absl::StrCat("give ", kLeastLease_s, " to ", kMostLease_s, " seconds, or 0 for ", kUsualLease_s));
}

bool IsOpen(const v1::CaptureSession& session) { return session.state() == v1::CAPTURE_SESSION_STATE_OPEN; }

std::chrono::nanoseconds LeaseOf(const v1::CaptureSession& session) {
  // A file may say anything.
  const double lease_s = session.lease_s() >= 0 ? std::min(session.lease_s(), kMostLease_s) : 0;
  return std::chrono::nanoseconds(std::llround(lease_s * 1e9));
}

// Without what the daemon adds: the same for requests that ask for the same.
bool AsksForTheSame(const v1::OpenSessionRequest& request, const v1::CaptureSession& session) {
  return request.cameras().SerializeAsString() == session.cameras().SerializeAsString() &&
         request.owner() == session.owner() && request.rig() == session.rig() &&
         request.board() == session.board() && request.garment() == session.garment();
}

std::string WordsOf(const v1::CaptureSession& session) {
  return absl::StrCat("session ", session.id(), " of ", session.owner());
}

const char* StateWords(v1::CaptureSessionState state) {
  switch (state) {
    case v1::CAPTURE_SESSION_STATE_EXPIRED:
      return "has expired: its lease was not renewed";
    case v1::CAPTURE_SESSION_STATE_TAKEN_OVER:
      return "was taken over";
    default:
      return "was closed";
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<SessionRegistry>> SessionRegistry::Create(
    const std::string& folder, std::function<Clock::time_point()> now) {
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  std::unique_ptr<SessionRegistry> keeper(new SessionRegistry(folder, std::move(now)));
  keeper->Load();
  return keeper;
}

void SessionRegistry::Load() {
  const MutexLock lock(mutex_);
  std::error_code error;
  for (const auto& file : std::filesystem::directory_iterator(folder_, error)) {
    if (file.path().extension() != ".json") continue;
    Entry entry;
    absl::Status status = ReadJsonFile(file.path(), entry.session);
    if (status.ok() && entry.session.id() != file.path().stem()) {
      status = absl::DataLossError(
          absl::StrCat(file.path().string(), ": is session \"", entry.session.id(), "\"; remove the file"));
    }
    if (!status.ok()) {
      warnings_.push_back(EscapedText(std::string(status.message())));
      spdlog::warn("{}", warnings_.back());
      continue;
    }
    entry.expires = now_() + LeaseOf(entry.session);
    entries_[file.path().stem()] = std::move(entry);
  }
  std::vector<std::string> ended;  // oldest first
  for (const auto& [id, entry] : entries_) {
    if (!IsOpen(entry.session)) ended.push_back(id);
  }
  for (size_t i = 0; i + kMostEndedSessions < ended.size(); ++i) {
    std::filesystem::remove(FileOf(ended[i]), error);
    entries_.erase(ended[i]);
  }
}

absl::Status SessionRegistry::Write(const v1::CaptureSession& session) const {
  return WriteJsonFile(FileOf(session.id()), session);
}

absl::Status SessionRegistry::End(Entry& entry, v1::CaptureSessionState state, const std::string& by) {
  v1::CaptureSession ended = entry.session;
  ended.set_state(state);
  ended.set_ended_by(by);
  ended.set_ended_unix_ns(HostTime_ns());
  WEFT_RETURN_IF_ERROR(Write(ended));
  entry.session = std::move(ended);
  spdlog::info("{} {}", WordsOf(entry.session), StateWords(state));
  return absl::OkStatus();
}

void SessionRegistry::EndExpired() {
  for (auto& [id, entry] : entries_) {
    if (!IsOpen(entry.session) || now_() < entry.expires) continue;
    if (absl::Status status = End(entry, v1::CAPTURE_SESSION_STATE_EXPIRED, ""); !status.ok()) {
      // The disk does not decide who may film.
      entry.session.set_state(v1::CAPTURE_SESSION_STATE_EXPIRED);
      entry.session.set_ended_unix_ns(HostTime_ns());
      spdlog::warn("{}", EscapedText(std::string(status.message())));
    }
  }
}

v1::CaptureSession SessionRegistry::Shown(const Entry& entry) const {
  v1::CaptureSession shown = entry.session;
  shown.clear_lease();
  if (IsOpen(shown)) shown.set_remaining_s(std::chrono::duration<double>(entry.expires - now_()).count());
  return shown;
}

std::map<std::string, SessionRegistry::Entry*> SessionRegistry::Holders() {
  std::map<std::string, Entry*> holders;
  for (auto& [id, entry] : entries_) {
    if (!IsOpen(entry.session)) continue;
    for (const std::string& device : DevicesOf(entry.session.cameras())) holders[device] = &entry;
  }
  return holders;
}

absl::StatusOr<v1::CaptureSession> SessionRegistry::Open(const v1::OpenSessionRequest& request,
                                                         const Caller& caller) {
  WEFT_RETURN_IF_ERROR(CheckOpenRequest(request));
  const MutexLock lock(mutex_);
  EndExpired();
  std::string id = request.idempotency_key();
  if (id.empty()) id = NewTimedId();
  if (const auto known = entries_.find(id); known != entries_.end()) {
    // What follows has the lease. Ids are known to all, and those of sessions without a key are ids as well.
    WEFT_RETURN_IF_ERROR(CheckRepeats(caller, known->second.session.opened_by(),
                                      AsksForTheSame(request, known->second.session),
                                      absl::StrCat("session ", id, " was opened")));
    v1::CaptureSession session = Shown(known->second);
    session.set_lease(known->second.session.lease());
    return session;
  }
  if (!request.take_over())
    WEFT_RETURN_IF_ERROR(CheckCamerasAreFreeLocked("cameras.cameras", request.cameras(), id));
  FairShare share(kOpenSessions, "open sessions");
  for (const auto& [other_id, entry] : entries_) {
    if (IsOpen(entry.session)) share.Take(entry.session.opened_by());
  }
  WEFT_RETURN_IF_ERROR(share.Check(caller));
  Entry entry;
  entry.session.set_id(id);
  *entry.session.mutable_cameras() = request.cameras();
  entry.session.set_rig(request.rig());
  entry.session.set_board(request.board());
  entry.session.set_garment(request.garment());
  entry.session.set_owner(request.owner());
  entry.session.set_opened_by(caller.name);
  entry.session.set_lease_s(request.lease_s() == 0 ? kUsualLease_s : request.lease_s());
  entry.session.set_state(v1::CAPTURE_SESSION_STATE_OPEN);
  entry.session.set_opened_unix_ns(HostTime_ns());
  entry.session.set_lease(NewLease(id));
  const std::set<std::string> wanted = DevicesOf(request.cameras());
  for (const auto& [device, other] : Holders()) {
    if (wanted.contains(device) && IsOpen(other->session))
      WEFT_RETURN_IF_ERROR(End(*other, v1::CAPTURE_SESSION_STATE_TAKEN_OVER, request.owner()));
  }
  WEFT_RETURN_IF_ERROR(Write(entry.session));
  entry.expires = now_() + LeaseOf(entry.session);
  spdlog::info("{} is open, with {} cameras", WordsOf(entry.session), entry.session.cameras().cameras_size());
  v1::CaptureSession session = Shown(entry);
  session.set_lease(entry.session.lease());
  entries_[id] = std::move(entry);
  return session;
}

absl::StatusOr<SessionRegistry::Entry*> SessionRegistry::FindByLease(const std::string& lease) {
  const auto found = entries_.find(lease.substr(0, lease.find('.')));
  if (found == entries_.end() || found->second.session.lease() != lease) {
    return FieldError(absl::StatusCode::kPermissionDenied,
                      {"lease", "fits no session", "give the lease that OpenSession answered"});
  }
  return &found->second;
}

absl::StatusOr<v1::CaptureSession> SessionRegistry::Renew(const std::string& lease) {
  const MutexLock lock(mutex_);
  EndExpired();
  WEFT_ASSIGN_OR_RETURN(Entry* const entry, FindByLease(lease));
  v1::CaptureSession& session = entry->session;
  if (!IsOpen(session)) {
    const std::string by = session.ended_by().empty() ? "" : absl::StrCat(" by ", session.ended_by());
    return FieldError(
        absl::StatusCode::kFailedPrecondition,
        {"lease", absl::StrCat(WordsOf(session), " ", StateWords(session.state()), by), "open a new one"});
  }
  entry->expires = now_() + LeaseOf(session);
  return Shown(*entry);
}

absl::StatusOr<v1::CaptureSession> SessionRegistry::Close(const std::string& lease) {
  const MutexLock lock(mutex_);
  EndExpired();
  WEFT_ASSIGN_OR_RETURN(Entry* const entry, FindByLease(lease));
  if (IsOpen(entry->session)) {
    WEFT_RETURN_IF_ERROR(End(*entry, v1::CAPTURE_SESSION_STATE_CLOSED, ""));
  }
  return Shown(*entry);
}

absl::StatusOr<v1::CaptureSession> SessionRegistry::Get(const std::string& id) {
  const MutexLock lock(mutex_);
  EndExpired();
  const auto found = entries_.find(id);
  if (found != entries_.end()) return Shown(found->second);
  return FieldError(
      absl::StatusCode::kNotFound,
      {"session_id", absl::StrCat("no session \"", EscapedText(id), "\""), "`weft session list` shows them"});
}

absl::StatusOr<v1::ListSessionsResponse> SessionRegistry::List(size_t limit, const std::string& page_token) {
  WEFT_RETURN_IF_ERROR(CheckPageToken(page_token));
  const MutexLock lock(mutex_);
  EndExpired();
  v1::ListSessionsResponse response;
  if (page_token.empty()) response.mutable_warnings()->Assign(warnings_.begin(), warnings_.end());
  std::map<std::string, const Entry*, std::greater<>> newest_first;
  for (const auto& [id, entry] : entries_)
    newest_first[PlaceByAge(entry.session.opened_unix_ns(), id)] = &entry;
  const auto show = [this](const Entry* entry)
                        ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return Shown(*entry); };
  response.set_next_page_token(AddPage(newest_first, limit, page_token, show, response.mutable_sessions()));
  return response;
}

absl::Status SessionRegistry::CheckCamerasAreFree(const std::string& field, const v1::Session& cameras,
                                                  const std::string& id) {
  const MutexLock lock(mutex_);
  EndExpired();
  return CheckCamerasAreFreeLocked(field, cameras, id);
}

absl::Status SessionRegistry::CheckCamerasAreFreeLocked(const std::string& field, const v1::Session& cameras,
                                                        const std::string& id) {
  const std::set<std::string> wanted = DevicesOf(cameras);
  for (const auto& [device, other] : Holders()) {
    if (!wanted.contains(device) || other->session.id() == id) continue;
    const double remaining_s = std::chrono::duration<double>(other->expires - now_()).count();
    return FieldError(absl::StatusCode::kFailedPrecondition,
                      {field,
                       absl::StrFormat("camera %s belongs to %s, whose lease lasts %.0f s more", device,
                                       WordsOf(other->session), std::max(0.0, remaining_s)),
                       "have it closed, wait, or take it over"});
  }
  return absl::OkStatus();
}

std::map<std::string, std::string> SessionRegistry::UsersOfDevices() {
  const MutexLock lock(mutex_);
  EndExpired();
  std::map<std::string, std::string> users;
  for (const auto& [device, entry] : Holders()) users[device] = WordsOf(entry->session);
  return users;
}

}  // namespace weft
