// The meshes of a job's result, read for the view in three dimensions.
#pragma once

#include <string>
#include <vector>

#include "services/results/report/job_report_parts.h"
#include "services/results/report/mesh_colors.h"
#include "weft/v1/page.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

struct MeshOfFrame {
  TriangleMesh mesh;
  RegisteredMesh registered;  // only vertices_mm of an import, where nothing was measured
};
// Errors of ReadPly, MeshFromPly and RegisteredMeshFromPly.
absl::StatusOr<MeshOfFrame> ReadMeshOfFrame(const std::string& path);

// Meshes of `frames` (<out_folder>/<frame>/mesh.ply) that are registered or bridged, at most those of
// SequenceFrames; one after another, so that memory holds one of them beside what the page keeps. Colourings:
// state and sigma where they were measured, and `values`. Those that cannot be read, or have another number
// of vertices, are left out with a line in `notes`. Without frames where there is none.
v1::PageSequence ReadSequence(const std::string& out_folder, const std::vector<v1::FrameReport>& frames,
                              const ScalarRange& sigma_range_mm, const std::vector<VertexValues>& values,
                              std::vector<std::string>& notes);

}  // namespace weft
