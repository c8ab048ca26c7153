// A folder that has its name only when it is whole.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

inline constexpr char kUnfinishedEnd[] = ".unfinished";

// Is written as "<place>.unfinished", and renamed; where the place is the root of a disk or the current
// folder, as
// "<place>/.unfinished", whose content then moves up. It goes away where it is not finished; what a process
// that was killed left is removed by the next one. Thread safety: none.
class UnfinishedFolder {
 public:
  // Makes the empty folder, and its parents where they are missing. AlreadyExists: `place` is there, and is
  // no empty folder. FailedPrecondition: another process writes it. Errors of CreateFolders.
  static absl::StatusOr<UnfinishedFolder> Begin(const std::string& place);
  // The same for a place that may be there; Publish is up to the caller, who moves the folder away.
  static absl::StatusOr<UnfinishedFolder> BeginBeside(const std::string& place);

  UnfinishedFolder(UnfinishedFolder&&) = default;
  UnfinishedFolder& operator=(UnfinishedFolder&&) = delete;
  ~UnfinishedFolder();

  // Where to write.
  const std::string& path() const { return path_; }

  // Gives it its name, which is on the disk then. AlreadyExists: something has the name by now. Unavailable.
  absl::Status Publish();

 private:
  UnfinishedFolder(std::string place, std::string path, UniqueFd lock)
      : place_(std::move(place)), path_(std::move(path)), lock_(std::move(lock)) {}
  static absl::StatusOr<UnfinishedFolder> BeginAt(const std::string& place, const std::string& path);
  absl::Status MoveUp();

  std::string place_, path_;
  UniqueFd lock_;  // closed: moved from, or finished
};

}  // namespace weft
