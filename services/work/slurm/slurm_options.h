// How tasks run on a cluster whose scheduler is Slurm.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/task.pb.h"

namespace weft {

struct SlurmOptions {
  std::string folder;  // for the files of tasks; the nodes must see it. Empty: no Slurm
  int tasks = 0;       // that may run at once; 0: as many as Slurm lets
  int frames_per_task = 8;
  int cpus_per_task = 1;
  int64_t memory_mib = 0;  // of a task; 0: as measured, see MemoryFor
  int time_limit_min = 0;  // of a task; 0: the partition's
  std::string partition, account, qos;
  std::vector<std::string> extra;         // further options of sbatch, "--name=value"
  std::string worker_program;             // as nodes see it
  std::string setup_file;                 // lines of shell that run before the worker, e.g. `module load`
  std::vector<std::string> mapped_paths;  // "HERE=THERE": what nodes see elsewhere
  std::string scratch_folder;             // of each node, for copies of images; empty: none are made
  int64_t scratch_mib = 8192;             // of the copies of a task
  double lag_s = 30;                      // how late nodes and daemon may see each other's files
  double query_s = 10;                    // between queries, at the least
  // Of every task, see task.proto.
  std::vector<std::string> allowed_paths;
  std::string state_folder;
  // Where sbatch, squeue, scancel and scontrol are; empty: in PATH.
  std::string programs_folder;
  std::chrono::milliseconds event_period{250};                        // between looks at files of events
  std::chrono::milliseconds stop_patience{std::chrono::seconds(25)};  // for the confirmed end of all tasks

  // InvalidArgument names the option of weftd.
  absl::Status Validate() const;
};

// Paths that nodes see elsewhere.
class PathMap {
 public:
  // InvalidArgument: not "HERE=THERE" with two absolute paths.
  static absl::StatusOr<PathMap> Create(const std::vector<std::string>& mapped_paths);

  // What nodes see `path` as: the longest HERE that it lies in decides; others stay.
  std::string OnNodes(const std::string& path) const;
  // The same for all paths of a task. FailedPrecondition: scans or start meshes would have another path
  // there, which is part of what identifies a result.
  absl::Status Apply(v1::Task& task) const;

 private:
  std::vector<std::pair<std::string, std::string>> pairs_;
};

}  // namespace weft
