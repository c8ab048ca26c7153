// A printed sheet of 8 x 8 cells of 10 mm on disk: its template and rig, and moments of it as truth and
// result.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/truth_file.h"
#include "services/results/evaluation/evaluation_inputs.h"
#include "simulation/cloth.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"

namespace weft {

class SheetOnDisk {
 public:
  using Positions = std::vector<Eigen::Vector3d>;
  static constexpr int kSide = 8, kCells = kSide * kSide;

  SheetOnDisk() : board(*GenerateBoard(kSide, kSide, 10, 1)), garment(Sheet(kSide)) {
    EXPECT_TRUE(WriteTemplate(folder / "take/template", garment).ok());
    EXPECT_TRUE(WriteRig(folder / "take/rig.json", *MakeStudioRig("ring", {.cameras = 4})).ok());
  }

  // The uppermost rows of the sheet.
  Template Sheet(int rows) const {
    const auto cloth = BuildCloth({.shape = ClothShape::kSheet, .rows = rows, .cols = kSide, .cell_mm = 10});
    EXPECT_TRUE(cloth.ok()) << cloth.status();
    const auto sheet = ImportTemplate("sheet", cloth->rest, cloth->cell_of_vertex, board);
    EXPECT_TRUE(sheet.ok()) << sheet.status();
    return *sheet;
  }

  const Positions& rest() const { return garment.rest.vertices_mm; }

  static Positions Moved(Positions positions, const Eigen::Vector3d& by_mm) {
    for (Eigen::Vector3d& position : positions) position += by_mm;
    return positions;
  }

  // Cells of the upper four rows are in three views, all others in two.
  void WriteTruth(const std::string& frame, const Positions& positions_mm) const {
    FrameTruth truth;
    truth.mesh = {positions_mm, garment.rest.faces};
    for (const int view : {0, 1, 2}) {
      ViewTruth& seen = truth.views.emplace_back();
      seen.camera_id = absl::StrCat("c", view);
      for (int v = 0; v < (view < 2 ? kCells : kCells / 2); ++v) {
        NodeTruth& node = seen.nodes.emplace_back();
        node.node = {v / kSide, v % kSide, NodeKind::kCenter};
        node.vertex = v, node.pitch_px = 5, node.visible = node.scoreable = true;
      }
    }
    EXPECT_TRUE(WriteFrameTruth(folder / ("take/truth/" + frame), truth).ok());
  }

  // Without states: a mesh that tells none.
  void WriteResultMesh(const std::string& frame, const Positions& positions_mm,
                       const std::vector<VertexState>& states, const std::string& result = "result") const {
    WriteMeshWithFaces(frame, positions_mm, states, garment.rest.faces, result);
  }
  void WriteMeshWithFaces(const std::string& frame, const Positions& positions_mm,
                          const std::vector<VertexState>& states, const std::vector<Face>& faces,
                          const std::string& result = "result") const {
    const std::string path = folder / absl::StrCat(result, "/", frame, "/mesh.ply");
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    if (states.empty()) {
      EXPECT_TRUE(WriteMesh(path, {positions_mm, faces}).ok());
      return;
    }
    RegisteredMesh mesh{positions_mm, states, std::vector<float>(states.size(), 0.1F),
                        std::vector<int>(states.size(), 3)};
    EXPECT_TRUE(WriteRegisteredMesh(path, mesh, faces).ok());
  }

  EvaluationRequest Request() const {
    EvaluationRequest request;
    request.result = folder / "result", request.garment = folder / "take/template";
    request.truth = folder / "take/truth";
    request.quick = true;
    return request;
  }

  TempFolder folder;
  Board board;
  Template garment;
};

}  // namespace weft
