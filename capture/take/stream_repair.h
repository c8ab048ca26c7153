// One stream of a take that is repaired: gaps for what is gone, what is cut kept aside.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/take/take_scan.h"

namespace weft {

// Where a repair puts what it replaces or cuts: <take>/recovered/<number>, made when first needed.
class KeptAside {
 public:
  explicit KeptAside(std::string take) : take_(std::move(take)) {}
  // Path of a new file there.
  absl::StatusOr<std::string> Path(const std::string& name);
  // The file under its name stays where it is, and its content there too, whatever is renamed onto the name
  // next.
  absl::Status Keep(const std::string& path);
  // What is there is on the disk.
  absl::Status Sync() const;
  // Empty where nothing was kept.
  const std::string& folder() const { return folder_; }

 private:
  const std::string take_;
  std::string folder_;
};

// A chunk of the repaired stream: an intact one of the old stream, or a gap.
struct PlannedChunk {
  uint64_t set = 0;
  const IndexRecord* intact = nullptr;  // null: a gap
  int64_t device_time_ns = 0;
  int64_t host_time_ns = 0;
  std::string reason;  // of a gap
};

struct StreamPlan {
  const ScannedStream* stream = nullptr;
  StreamHeader header;
  std::vector<PlannedChunk> chunks;
  bool is_rewritten = false;  // gaps stand between intact chunks, or the header is damaged: a new file
  size_t first_appended = 0;  // else: chunks from here on are appended
  uint64_t cut_bytes = 0;     // after the last intact chunk, but for zeros
  bool needs_end = false;     // a new end record
  bool needs_index = false;

  bool has_changes() const {
    return is_rewritten || first_appended < chunks.size() || cut_bytes > 0 || needs_end || needs_index ||
           changes_length;
  }
  bool changes_length = false;  // of the file alone: reserved room, or padding that was cut
};

// Decides what is done with the stream so that it holds `chunks`.
absl::StatusOr<StreamPlan> PlanStream(const std::string& take_folder, const ScannedStream& stream,
                                      StreamHeader header, std::vector<PlannedChunk> chunks);

// Does it: stream, end record, index. `end`: of the take; chunks and last set are filled in. Each file is
// replaced or appended to so that a repair that is interrupted can be made again.
absl::Status ApplyPlan(const std::string& take_folder, const StreamPlan& plan, StreamEnd end,
                       KeptAside& aside);

// The bytes become the content of `path` at once, or not at all.
absl::Status ReplaceFile(const std::string& path, const std::string& bytes);

}  // namespace weft
