// The commands of Slurm: sbatch, squeue, scancel and scontrol.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/work/slurm/slurm_state.h"

namespace weft {

// Thread safety: const access by one thread at a time. Calls wait for the command, 20 s at most.
class SlurmCommands {
 public:
  // Finds the commands in `folder`, or in PATH where that is empty. NotFound names the one that is missing.
  static absl::StatusOr<SlurmCommands> Find(const std::string& folder);

  // The id of the job that sbatch makes of these arguments. Unavailable: Slurm does not answer, or takes no
  // job now; the same call may succeed later. ResourceExhausted: these are more elements than it takes now.
  // FailedPrecondition: it refuses these options for good.
  absl::StatusOr<int64_t> Submit(const std::vector<std::string>& arguments) const;
  // The most elements that an array may have, by MaxArraySize and MaxJobCount of the cluster. Unavailable: no
  // answer.
  absl::StatusOr<int> MostElements() const;
  // All jobs that Slurm knows of this user, in one query. Unavailable: no answer.
  absl::StatusOr<std::vector<SlurmRecord>> Query() const;
  // `jobs`: "12", or "12_3" for an element of an array. Those that have ended are no error. Unavailable.
  absl::Status Cancel(const std::vector<std::string>& jobs) const;
  // How many elements of an array may run at once. Unavailable.
  absl::Status SetThrottle(int64_t array_id, int running) const;

 private:
  absl::StatusOr<std::string> Run(const std::string& program,
                                  const std::vector<std::string>& arguments) const;

  std::string sbatch_, squeue_, scancel_, scontrol_;
};

// Whether what sbatch printed says that the same options will never do.
bool IsRefusedForGood(const std::string& printed);
// Whether it says that they were too many: fewer elements, or the same later, may do.
bool IsTooMany(const std::string& printed);

}  // namespace weft
