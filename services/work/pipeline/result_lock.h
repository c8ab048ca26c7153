// One writer per folder of results.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/formats/files/confined_folder.h"
#include "services/formats/files/holder_record.h"

namespace weft {

// Holds <out>/.weft-lock, which says who holds it, with flock(), and <out>/.weft-lock.holder (HolderRecord),
// which keeps out those whom flock() does not: over FUSE, or from other machines. Whoever dies lets go of
// both. Thread safety: none.
class ResultLock {
 public:
  static constexpr char kFileName[] = ".weft-lock";
  static constexpr char kHolderName[] = ".weft-lock.holder";

  // `out` is an absolute path without links, of a folder that exists. `owner` in words, e.g. "weft register";
  // process and machine are added. Tries again for as long as `patience`, since a process that was killed
  // lets go only when it is gone. FailedPrecondition: another process holds it; the message says which, and
  // what to do. Otherwise errors of ConfinedFolder::Open and WriteFileAtomically.
  static absl::StatusOr<ResultLock> Acquire(const std::string& out, const std::string& owner,
                                            std::chrono::milliseconds patience);
  ResultLock(ResultLock&&) = default;
  ResultLock& operator=(ResultLock&&) = default;
  // Removes the file and lets go.
  ~ResultLock();

  // Takes the lock anew where the file was removed or replaced meanwhile, for example with the whole folder,
  // which is made again. Errors as Acquire; FailedPrecondition as well where another process took the folder
  // while this one stood still.
  absl::Status Renew();

 private:
  ResultLock(ConfinedFolder folder, UniqueFd file, std::string owner, std::optional<HolderRecord> holder)
      : folder_(std::move(folder)),
        file_(std::move(file)),
        owner_(std::move(owner)),
        holder_(std::move(holder)) {}
  bool IsInPlace() const;

  ConfinedFolder folder_;
  UniqueFd file_;
  std::string owner_;
  std::optional<HolderRecord> holder_;  // none: it could not be written, on a full disk for example
};

}  // namespace weft
