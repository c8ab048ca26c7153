// What frames bring besides images: scans by other methods, and meshes to start from.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/report.pb.h"

namespace weft {

// The scans of a folder, by frame. A file is the scan of a frame when its name without ending is that of the
// frame, or when both have one number each, and the same one: scan_012.ply is that of frame 0012. Endings are
// .ply and .pcd in upper or lower case; hidden files do not count.
class ScanFolder {
 public:
  // InvalidArgument or NotFound names the folder: it is not there, is no folder, cannot be listed.
  static absl::StatusOr<ScanFolder> List(const std::string& folder);

  // Path of the frame's scan, empty where it has none. PLY goes before PCD. InvalidArgument names two files
  // that are both of the frame.
  absl::StatusOr<std::string> Of(const std::string& frame) const;

  // Names of all scans, in their order.
  std::vector<std::string> names() const;

 private:
  std::string folder_;
  std::vector<std::string> names_;
  std::map<std::string, std::vector<size_t>> of_stem_, of_number_;
};

// Whether the folders options.scans and options.starts are there and have something for the frames of a job.
// Returns what operators should know: frames without a scan or a start, scans that are of no frame of the
// dump. InvalidArgument or NotFound names folder and remedy. `is_live`: more frames will come.
absl::StatusOr<std::vector<std::string>> CheckExtras(const v1::RegistrationOptions& options,
                                                     const std::vector<std::string>& dump_frames,
                                                     const std::vector<std::string>& job_frames,
                                                     bool is_live);

}  // namespace weft
