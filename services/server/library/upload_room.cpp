// Uploads: for how much there is room, on the disk and for one caller.
#include <sys/statvfs.h>

#include <algorithm>
#include <cerrno>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "services/server/callers/fair_share.h"
#include "services/server/callers/owners.h"
#include "services/server/library/uploads.h"

namespace weft {
namespace {

constexpr int64_t kSpareBytes = int64_t{64} << 20;  // for the list of jobs
// Those that nobody goes on with stay as long as the retention says.
constexpr ShareLimits kUnfinished{.all = 1000, .of_one_caller = 200, .reserve = 50};
// Of the disk's free bytes that the unfinished uploads of one client may take.
constexpr double kShareOfDisk = 0.75;

}  // namespace

absl::Status Uploads::CheckShare(const std::string& upload_id, int64_t bytes, const Caller& caller) const {
  FairShare share(kUnfinished, "unfinished uploads");
  int64_t others = 0;  // bytes of the caller's other uploads
  for (const auto& [id, begun] : begun_) {
    if (id == upload_id) continue;
    share.Take(begun.caller);
    if (IsSameAccount(begun.caller, caller.name)) others += begun.bytes;
  }
  // What has begun has its place.
  if (absl::Status status = share.Check(caller); !status.ok() && !begun_.contains(upload_id)) return status;
  WEFT_ASSIGN_OR_RETURN(const Room room, RoomOnDisk());
  const int64_t free_bytes = std::max<int64_t>(0, room.free_bytes - room.spare_bytes);
  const auto most = static_cast<int64_t>(kShareOfDisk * static_cast<double>(free_bytes));
  if (IsOperator(caller) || bytes <= most - others) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      "manifest: ", bytes, " bytes are to come, and other unfinished uploads of ", caller.name, " have ",
      others, "; of the ", free_bytes, " bytes that ", state_folder_, " has for uploads one client may take ",
      most, ": finish uploads, or ask an operator to delete items"));
}

absl::StatusOr<Uploads::Room> Uploads::RoomOnDisk() const {
  struct statvfs disk;
  if (statvfs(state_folder_.c_str(), &disk) != 0)
    return FileError(state_folder_, "cannot be looked at", errno);
  return Room{static_cast<int64_t>(disk.f_bavail) * static_cast<int64_t>(disk.f_frsize),
              std::max(kSpareBytes, static_cast<int64_t>(least_free_bytes_.load()))};
}

absl::Status Uploads::CheckRoom(const char* field, int64_t more_bytes) const {
  WEFT_ASSIGN_OR_RETURN(const Room room, RoomOnDisk());
  const auto [free_bytes, spare_bytes] = room;
  if (more_bytes <= free_bytes - spare_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      field, ": ", more_bytes, " bytes are to come, but ", state_folder_, " has ", free_bytes,
      " bytes free, of which ", spare_bytes,
      least_free_bytes_ > kSpareBytes ? " stay free by --least-free-gib" : " are kept for the list of jobs",
      "; delete items that nobody needs"));
}

}  // namespace weft
