// The newest frame set of a take that another process records, read for the cost of what is new.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "capture/take/stream_reader.h"

namespace weft {

// Thread safety: none.
class GrowingTake {
 public:
  // Opens the streams of the rig's cameras; those that the take lacks are missing in every set. Errors of
  // StreamReader. InvalidArgument: the take has no camera of the rig.
  static absl::StatusOr<GrowingTake> Open(const std::string& folder, const Rig& rig);

  // The set of this number as a source of one frame, SetInMemory; pictures that are damaged or not there are
  // missing. Numbers must not decrease. Errors of the disk.
  absl::StatusOr<std::shared_ptr<const FrameSource>> Read(uint64_t number);

 private:
  struct Stream {
    std::unique_ptr<StreamReader> reader;  // null where the take has none
    std::string index_path;
    uint64_t index_bytes = 0;         // that were read
    std::vector<IndexRecord> recent;  // what the last look found
  };
  explicit GrowingTake(Rig rig) : rig_(std::move(rig)) {}
  static absl::StatusOr<const IndexRecord*> FindRecord(Stream& stream, uint64_t number);

  Rig rig_;
  std::vector<Stream> streams_;  // of the rig's cameras
};

}  // namespace weft
