// The takes that a daemon records: a folder each, with a recorder of its own.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/retention/retention_plan.h"
#include "weft/v1/session.pb.h"
#include "weft/v1/takes.pb.h"

namespace weft {

struct TakeStoreOptions {
  std::string takes_folder;  // a folder per take
  std::string trash_folder;  // on the same disk
  std::string looks_folder;  // of FilmBriefly; emptied when the keeper begins
  std::string recorder_program;
  // A take that cameras of a session replay, as a path that may be read. Errors name the field.
  std::function<absl::StatusOr<std::string>(const std::string& field, const std::string& take)> resolve_take;
  // Asked before new work is taken; its errors refuse it.
  std::function<absl::Status()> admit = [] { return absl::OkStatus(); };
  // Called once for each take that has ended, and again where it failed or the daemon was killed meanwhile.
  std::function<absl::Status(const v1::RecordedTake& take)> on_end = [](const v1::RecordedTake&) {
    return absl::OkStatus();
  };
  // Whether an unfinished job or operation reads this folder.
  std::function<bool(const std::string& folder)> is_read = [](const std::string&) { return false; };
};

// The folders are all that is remembered: takes go on without a daemon, and the next one finds them. Thread
// safety: any thread may call any function.
class TakeStore {
 public:
  explicit TakeStore(TakeStoreOptions options) : options_(std::move(options)) {}
  // Closes takes whose recorders died, in the background until Stop.
  void Begin();
  void Stop();

  // Errors as takes.proto says; those of StartRecorder.
  absl::StatusOr<v1::RecordedTake> Start(const v1::StartTakeRequest& request);
  absl::StatusOr<v1::RecordedTake> Stop(const std::string& id);
  absl::StatusOr<v1::RecordedTake> Get(const std::string& id);
  // Newest first.
  v1::ListTakesResponse List(const v1::ListTakesRequest& request, size_t limit);

  absl::StatusOr<v1::RecordedTake> Pin(const std::string& id, bool pinned);
  absl::StatusOr<v1::RecordedTake> Describe(const v1::DescribeTakeRequest& request);
  absl::StatusOr<v1::RecordedTake> Delete(const std::string& id, const std::string& because);
  absl::StatusOr<v1::RecordedTake> Restore(const std::string& id);
  // One take of the trash, or all of it.
  absl::StatusOr<v1::EmptyTrashResponse> EmptyTrash(const std::string& id);
  // Takes in a take that was made by other means, and moves its folder; `origin` says how it came about, for
  // people. A take of this id that is there already stays.
  absl::Status Adopt(const std::string& take_folder, const std::string& id, const std::string& origin);
  // All takes, and all that lies in the trash.
  std::vector<Holding> Holdings();
  // Errors of Delete and EmptyTrash.
  absl::Status Carry(const RetentionStep& step);

  // A take of a moment, which `use` may read before it is removed. No take starts meanwhile. Errors of
  // CheckCamerasAreFree, StartRecorder, and those that the recorder met.
  absl::Status FilmBriefly(const v1::Session& session,
                           const std::function<void(const std::string& take)>& use);

  // FailedPrecondition: a take that is being recorded uses one of these cameras; it is named, and `field`.
  absl::Status CheckCamerasAreFree(const std::string& field, const v1::Session& session) const;
  // "take ID" for each device that films.
  std::map<std::string, std::string> UsersOfDevices() const;

 private:
  std::string FolderOf(const std::string& id) const { return options_.takes_folder + "/" + id; }
  std::string TrashOf(const std::string& id) const { return options_.trash_folder + "/" + id; }
  // By id of the take that each living recorder writes.
  std::map<std::string, v1::Session> LivingSessions() const;
  // The folders of the takes that living recorders replay.
  std::set<std::string> ReplayedTakes() const;
  absl::Status ResolveReplays(const std::string& field, v1::Session& session) const;
  // Errors of Get.
  absl::StatusOr<v1::RecordedTake> GetLocked(const std::string& id) ABSL_EXCLUSIVE_LOCKS_REQUIRED(changing_);
  void WorkInBackground(const std::stop_token& stop);
  void CloseDead(std::set<std::string>& known);
  absl::Status NotifyEnd(const v1::RecordedTake& take) const;

  const TakeStoreOptions options_;
  Mutex starting_;  // one request at a time looks which cameras are free
  Mutex changing_;  // one take at a time is closed, moved or marked
  std::jthread background_;
};

}  // namespace weft
