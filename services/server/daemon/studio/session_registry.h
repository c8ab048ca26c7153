// The capture sessions of a daemon: who has which cameras, and until when.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/callers/caller.h"
#include "weft/v1/sessions.pb.h"

namespace weft {

// A file per session below its folder. What was answered is on the disk, but for renewals: an open session of
// an earlier daemon gets its whole lease again, as its owner could not renew it meanwhile. Thread safety: any
// thread may call any function.
class SessionRegistry {
 public:
  using Clock = std::chrono::steady_clock;
  // Makes the folder where it is missing. Errors of CreateFolders. Leases run by `now`.
  static absl::StatusOr<std::unique_ptr<SessionRegistry>> Create(
      const std::string& folder, std::function<Clock::time_point()> now = Clock::now);

  // The only answer with the lease. FailedPrecondition: another open session has one of the cameras.
  // AlreadyExists: the key stands for another request, or for one of somebody else. ResourceExhausted: too
  // many are open.
  absl::StatusOr<v1::CaptureSession> Open(const v1::OpenSessionRequest& request, const Caller& caller);
  // PermissionDenied: no session has this lease. FailedPrecondition: the session has ended.
  absl::StatusOr<v1::CaptureSession> Renew(const std::string& lease);
  absl::StatusOr<v1::CaptureSession> Close(const std::string& lease);
  // NotFound.
  absl::StatusOr<v1::CaptureSession> Get(const std::string& id);
  // Newest first. InvalidArgument: the page token.
  absl::StatusOr<v1::ListSessionsResponse> List(size_t limit, const std::string& page_token = "");

  // FailedPrecondition: an open session other than `id` has one of these cameras; it is named, and `field`.
  absl::Status CheckCamerasAreFree(const std::string& field, const v1::Session& cameras,
                                   const std::string& id);
  // "session ID of OWNER" for each device that an open session has.
  std::map<std::string, std::string> UsersOfDevices();

 private:
  struct Entry {
    v1::CaptureSession session;  // with its lease
    Clock::time_point expires;
  };
  SessionRegistry(std::string folder, std::function<Clock::time_point()> now)
      : folder_(std::move(folder)), now_(std::move(now)) {}
  void Load();
  std::string FileOf(const std::string& id) const { return folder_ + "/" + id + ".json"; }

  void EndExpired() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckCamerasAreFreeLocked(const std::string& field, const v1::Session& cameras,
                                         const std::string& id) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Write(const v1::CaptureSession& session) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Ends it on the disk first.
  absl::Status End(Entry& entry, v1::CaptureSessionState state, const std::string& by)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Open sessions by their devices.
  std::map<std::string, Entry*> Holders() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<Entry*> FindByLease(const std::string& lease) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::CaptureSession Shown(const Entry& entry) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string folder_;
  const std::function<Clock::time_point()> now_;
  Mutex mutex_;
  std::map<std::string, Entry> entries_ ABSL_GUARDED_BY(mutex_);  // by id; ids begin with their time
  std::vector<std::string> warnings_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
