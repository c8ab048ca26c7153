// What a result holds of one frame.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "evaluation/truth_score.h"
#include "weft/v1/report.pb.h"

namespace weft {

struct ResultMesh {
  TriangleMesh mesh;
  std::vector<VertexState> state;  // [vertices]; empty where the file does not tell states
  std::vector<double> sigma_mm;    // [vertices], per axis; empty where the file does not tell

  // [vertices] or empty: those that cameras measured in this very frame, three or more of them or two.
  std::vector<bool> Measured() const;
};

struct FramePieces {
  ResultPieces pieces;  // all but the mesh
  std::optional<ResultMesh> mesh;
  std::vector<std::string> missing;  // names of the files that are not there
};

// Empty: there is no observations.csv in the folder. Errors name the file.
absl::StatusOr<std::optional<std::vector<CameraObservations>>> ReadCameraObservations(
    const std::string& frame_folder);
// Reads <result>/<frame>/{observations.csv,cloud.ply,mesh.ply}. Errors name the file. DataLoss: one is not as
// the report of its frame lists it.
absl::StatusOr<FramePieces> ReadFramePieces(const std::string& frame_folder,
                                            const v1::FrameReport& report = {});
// Of a frame whose files are not used.
FramePieces NoFramePieces();
// NotFound: no such file.
absl::StatusOr<ResultMesh> ReadResultMesh(const std::string& path);

}  // namespace weft
