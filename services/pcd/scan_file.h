// Scans of other methods, as evidence for the alignment.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "alignment/scan.h"
#include "services/files/ply.h"

namespace weft {

// Points of a PLY file (element vertex: x y z in mm, nx ny nz where there are normals; faces are ignored) or,
// by the ending .pcd, of a PCD file (fields x y z, normal_x normal_y normal_z). Normals are brought to length
// 1; where one has no length, none are used. InvalidArgument names file and field; otherwise as ReadPoints.
absl::StatusOr<Scan> ReadScan(const std::string& path);

// The same for points that were read.
absl::StatusOr<Scan> ScanFromPly(const Ply& ply, const std::string& source_name);

}  // namespace weft
