// A registered mesh in as few bytes as a page needs to draw it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace weft {

// Bytes of a job's mesh.ply up to the end of its vertices, from the first ones of the file. None: its header
// goes on. InvalidArgument as that of QuantizedMesh.
absl::StatusOr<std::optional<size_t>> EndOfVertices(std::string_view ply, const std::string& source_name);

// A job's mesh.ply (binary little-endian, vertices first: x y z, state, sigma_mm, views) as below, all
// numbers little-endian. Without faces the bytes of EndOfVertices are enough. InvalidArgument names
// source_name and what is wrong: another layout, positions that are not finite, polygons, indices outside the
// vertices.
//
// 88 bytes: "weftmsh1"; vertices, faces, bytes of encoded vertices, bytes of encoded faces (32 bits each);
// steps along x y z in mm, the low corner of the vertices' box in mm, the largest error of a coordinate and
// the largest distance of a vertex from its quantised place in mm (8 doubles).
// Vertices: meshoptimizer's vertex codec, 8 bytes each: x y z as 16 bits in steps from the low corner; a byte
// of state (2 bits) and views (6 bits above, 63: or more; bridged vertices have none, so that bridged with n
// views is driven with n - 1); a byte of sigma, 16 per octave from 0.001 mm, 255:
// not a number. Faces: its index codec, 3 indices each. A step is the box's side / 65535, 0.005 mm at least,
// so the error of a coordinate is at most 0.016 mm along 2 m.
absl::StatusOr<std::string> QuantizedMesh(std::string_view ply, bool with_faces,
                                          const std::string& source_name);

}  // namespace weft
