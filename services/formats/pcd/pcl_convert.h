// Between PCD and PLY, in memory. Includes PCL; only the program weft-pcl links it.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "services/formats/files/ply.h"

namespace weft {

// The points of a PCD file as ParsePcd in pcd_file.h describes them. InvalidArgument says what is wrong with
// the file; what PCL itself says stands on standard error. Exceptions of PCL pass.
absl::StatusOr<Ply> PlyFromPcdFile(const std::string& path);

// As SerializePcd in pcd_file.h. InvalidArgument: no element "vertex".
absl::StatusOr<std::string> PcdFromPly(const Ply& ply);

}  // namespace weft
