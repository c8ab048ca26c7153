// What one frame is computed from, besides rig, board and template: its images, its scan and its start.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "capture/take/frame_source.h"
#include "weft/v1/job.pb.h"

namespace weft {

// The frame's scan in the folder `scans`: <frame>.ply or <frame>.pcd, or as ScanFolder finds it. Empty where
// there is none.
std::string ScanPath(const std::string& frame, const std::string& scans);

// The mesh that an earlier registration in the folder `starts` has of the frame. Empty where it has none.
std::string StartPath(const std::string& frame, const std::string& starts);

// Changes when the frame's images, its scan or its start do; reads none of them. Of files that lie in folders
// it sees name, size and time of the last change. OutOfRange: no such frame.
absl::StatusOr<std::string> FrameFingerprint(const FrameSource& dump, size_t index,
                                             const v1::RegistrationOptions& options);

// FrameFingerprint of the frames that a job reads, by their names, as they are now.
class FingerprintsNow {
 public:
  // Opens the dump anew. Errors of ReadRig and OpenDump.
  static absl::StatusOr<FingerprintsNow> Open(const v1::RegistrationSpec& spec);

  // Empty: the dump holds no such frame any more.
  std::string Of(const std::string& frame) const;

 private:
  FingerprintsNow() = default;

  v1::RegistrationOptions options_;
  std::unique_ptr<FrameSource> dump_;
  std::map<std::string, size_t> index_of_;
};

}  // namespace weft
