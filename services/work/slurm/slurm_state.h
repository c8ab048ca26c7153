// What Slurm says of its jobs: `squeue --json` and `scontrol show job`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// One record of Slurm: a job, an element of an array that has begun, or all elements of an array that wait.
struct SlurmRecord {
  int64_t job_id = 0;
  // Of an element: its array and index. Of those that wait: `waiting` has their indexes, `index` none.
  int64_t array_id = 0;
  std::optional<int64_t> index;
  std::vector<int64_t> waiting;
  bool waiting_is_cut = false;  // Slurm printed the first of them alone
  std::string state;            // in Slurm's words, e.g. "PENDING"
  std::string reason;           // why it is in that state, e.g. "PartitionDown"
  std::string node;
  std::string comment;
  std::string name;
  int64_t wait_status = 0;  // of its process, as waitpid has it
  int64_t submit_unix_s = 0, start_unix_s = 0, end_unix_s = 0;
  // What of it cannot be read; empty where all can. The ids are 0 where they cannot.
  std::string fault;
};

// Whether a record of this state is of a job that will not run any more.
bool HasEnded(const std::string& slurm_state);

// All records of `squeue --json`, of the versions 20.11 to 24.05: later ones have lists of states, and
// numbers as objects. A record with a field of another kind has a `fault` that names it. InvalidArgument: no
// JSON of squeue. Unavailable: the controller did not answer squeue, which says so in its JSON and ends with
// status 0.
absl::StatusOr<std::vector<SlurmRecord>> ParseSqueue(std::string_view json);

// All records of `scontrol show job`, whose values have no spaces that separate them for sure: what is wanted
// stands in fields without any. Faults as above. InvalidArgument: not its output.
absl::StatusOr<std::vector<SlurmRecord>> ParseScontrolJobs(std::string_view text);

// The indexes of "0-3,7,9-15:2%4"; what stands behind % limits how many run. InvalidArgument: none, or more
// than a million.
absl::StatusOr<std::vector<int64_t>> ParseArrayIndexes(std::string_view text);

// The record of an element of an array; null where Slurm has none. A job that is no array has the index 0.
// An element beyond the end of a cut list counts as waiting.
const SlurmRecord* FindElement(const std::vector<SlurmRecord>& records, int64_t array_id, int64_t index);

}  // namespace weft
