// Tables of points as PCD, the Point Cloud Library's format. All of it is done by PCL (pcl_program.h), so
// every function here has the errors of RunPclProgram.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/formats/files/ply.h"

namespace weft {

// Whether a file is PCD, by its ending.
bool IsPcdName(const std::string& path);

// A PCD file (ascii, binary or binary_compressed) as an element "vertex" with a property per field of one
// number a point, nx ny nz for normal_x normal_y normal_z. source_name stands in errors.
absl::StatusOr<Ply> ParsePcd(std::string_view bytes, const std::string& source_name);

// The element "vertex" as binary PCD: a field per property that is no list, nx ny nz as normal_x normal_y
// normal_z.
absl::StatusOr<std::string> SerializePcd(const Ply& ply);
absl::Status WritePcd(const std::string& path, const Ply& ply);

struct Points {
  Ply ply;
  size_t unmeasured = 0;  // points of the file that DropUnmeasured left out
};

// A PCD file or, by any other ending, a PLY file.
absl::StatusOr<Points> ReadPoints(const std::string& path);

}  // namespace weft
