// The named meshes of a frame's results: which there are, and the file of each.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "weft/v1/report.pb.h"

namespace weft {

// What a mesh is called that is the only one: its file is mesh.ply.
inline constexpr char kGarmentMesh[] = "garment";

// InvalidArgument: 1 to 32 of a to z, 0 to 9, "-" and "_", a letter first; not the name of another file of a
// frame.
absl::Status CheckMeshName(const std::string& name);
// In the frame's folder, of a name that passes CheckMeshName.
std::string MeshFileName(const std::string& name);

// 16 hex digits over the number of vertices and the faces.
std::string TopologyHash(size_t vertices, const std::vector<Face>& faces);

// Those that the report lists; of one of an earlier version mesh.ply, without a hash. InvalidArgument: a name
// that is none or occurs twice, or a file that is another than its name's.
absl::StatusOr<std::vector<v1::FrameMesh>> MeshesOf(const v1::FrameReport& report);

// The mesh that a reader of `reports` means by `name`; empty: the garment, or else the only one. Frames may
// lack it, and it is "garment" where none has any. NotFound: none has it, with the names that there are.
// InvalidArgument: several and no garment, or a topology that is not that of the frame before. Errors of
// MeshesOf.
absl::StatusOr<std::string> ChooseMesh(std::span<const v1::FrameReport> reports, const std::string& name);

}  // namespace weft
