// Tells a program, a server or both of each take and job that has ended.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/notice/notice_request.h"
#include "services/server/notice/outbox.h"
#include "weft/v1/notice.pb.h"

namespace weft {

struct NoticeOptions {
  std::string program;  // empty: none
  double program_timeout_s = 60;
  NoticeServer server;  // url empty: none

  // NotFound, PermissionDenied: the program. Errors of CheckNoticeServer.
  absl::Status Validate() const;
};

// Each notice is on the disk when a function returns, and is delivered at least once. Programs run two at a
// time and once, whatever their exit status; requests are repeated until they are given up. Thread safety:
// any thread.
class EndNotices {
 public:
  // Errors of CreateFolders.
  static absl::StatusOr<std::unique_ptr<EndNotices>> Open(const std::string& folder, NoticeOptions options);

  // Errors of Outbox::Put.
  absl::Status JobEnded(const v1::Job& job);
  // Takes that ended before notices were first kept in this folder are passed over.
  absl::Status TakeEnded(const v1::RecordedTake& take);

  // Those that nobody has taken, for a program or a server: "command/NAME" and "url/NAME".
  std::vector<Outbox::Waits> Waiting();
  // Errors of Outbox::GiveUp.
  absl::Status GiveUp(const std::string& name);

  // From now on, also for notices that wait.
  void SetOptions(NoticeOptions options);

 private:
  explicit EndNotices(NoticeOptions options) : options_(std::move(options)) {}
  NoticeOptions Options();
  absl::Status ReadBeginning(const std::string& path);
  absl::Status Notify(v1::EndNotice notice, const std::string& kind, const std::string& id);

  Mutex mutex_;
  NoticeOptions options_ ABSL_GUARDED_BY(mutex_);
  int64_t begun_unix_ns_ = 0;
  std::unique_ptr<Outbox> programs_, requests_;
};

}  // namespace weft
