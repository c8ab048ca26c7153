// Scans of other methods, as evidence for the alignment.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "alignment/scan.h"

namespace weft {

// Points of a PLY file (element vertex: x y z in mm, nx ny nz where there are normals; faces are ignored).
// With the ending .pcd: of a PCD file (fields x y z as floats or doubles, data ascii or binary; normal_x
// normal_y normal_z). Normals are brought to length 1; where one has no length, none are used.
// InvalidArgument names file and field; otherwise as ReadWholeFile.
absl::StatusOr<Scan> ReadScan(const std::string& path);

// The same for the bytes of a PCD file; source_name stands in errors.
absl::StatusOr<Scan> ParsePcd(const std::string& bytes, const std::string& source_name);

}  // namespace weft
