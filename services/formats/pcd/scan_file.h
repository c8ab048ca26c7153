// Scans of other methods, as evidence for the alignment.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "alignment/scan.h"
#include "services/formats/pcd/pcd_file.h"

namespace weft {

// A scan as its file has it.
struct ScanFile {
  Scan scan;
  int points = 0;          // of the file
  int unmeasured = 0;      // of them, left out: without a measurement, x, y or z is not finite
  int without_normal = 0;  // of the others: with a normal of no length or no number
};

// Points of a PLY file (element vertex: x y z in mm, nx ny nz where there are normals; faces are ignored) or,
// by the ending .pcd, of a PCD file (fields x y z, normal_x normal_y normal_z). Normals are brought to length
// 1. Points without a normal are left out where most have one; otherwise no normals are used.
// InvalidArgument names file and field, or a file without a measured point; otherwise as ReadPoints.
absl::StatusOr<ScanFile> ReadScan(const std::string& path);
// The same for points that were read.
absl::StatusOr<ScanFile> ScanFromPoints(const Points& points, const std::string& path);

}  // namespace weft
