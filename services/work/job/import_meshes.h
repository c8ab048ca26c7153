// Meshes of other programs as a result, so that whatever reads results reads them: export, evaluation,
// comparison.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

struct MeshImport {
  std::vector<std::string> meshes;  // OBJ or PLY, one of each frame, all of one garment
  std::string rest;                 // the garment at rest; empty: the first of them
  double unit_mm = 1;               // of all of them
  Eigen::Matrix3d world_from_mesh = Eigen::Matrix3d::Identity();  // a rotation, of all of them
  std::string out;

  // InvalidArgument: no meshes, files that are no meshes, a name twice.
  absl::Status Validate() const;
};

struct ImportedGarment {
  std::string garment;              // the file of the mesh at rest, <out>/garment.ply
  std::vector<std::string> frames;  // of the result, in their order
  size_t vertices = 0, faces = 0;
};

// Writes <out>/<frame>/{mesh.ply,report.json}, <out>/garment.ply and, last, <out>/job.json. Frames are named
// by the numbers in the names of the files, else by position. Nothing was measured, so meshes have neither
// states nor sigmas. `progress` (may be empty): frames done and all; each is read twice, which is half of its
// work. Errors of ReadGarmentMesh and ReadGarmentMoment before anything is written over. FailedPrecondition:
// `out` holds the result of a job. InvalidArgument: cloth more than 100 m from the origin. Cancelled: a stop
// was requested.
absl::StatusOr<ImportedGarment> ImportMeshes(const MeshImport& request,
                                             const std::function<void(size_t, size_t)>& progress,
                                             const std::stop_token& stop);

}  // namespace weft
