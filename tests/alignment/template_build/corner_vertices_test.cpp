#include "alignment/template_build/corner_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "alignment/cell_prediction.h"
#include "alignment/template_build/build_template.h"
#include "alignment/template_build/mesh_topology.h"
#include "simulation/printed_mesh.h"
#include "tests/alignment/template_build/sewn_tubes.h"

namespace weft {
namespace {

using testing::kPitchMm;

constexpr int kTubeRows = 12, kTubeCols = 20;

// Two panels side by side on the board: a rectangle with a hole, and one with its corner cut off.
BoardPanels TwoSheets() {
  BoardPanels panels{kTubeRows, kTubeCols, 2, std::vector<int>(kTubeRows * kTubeCols, -1)};
  for (int row = 1; row < kTubeRows - 1; ++row) {
    for (int col = 1; col < kTubeCols - 1; ++col) {
      const bool hole = row >= 5 && row <= 6 && col >= 4 && col <= 5;
      const bool cut = row + (kTubeCols - 1 - col) < 6;
      if (!hole && !cut) panels.panel_of_cell[row * kTubeCols + col] = col < kTubeCols / 2 ? 0 : 1;
    }
  }
  return panels;
}

double AreaMm2(const std::vector<Face>& faces, const std::vector<Eigen::Vector3d>& places_mm) {
  double sum = 0;
  for (const auto& [a, b, c] : faces) {
    const Eigen::Vector3d ab = places_mm[b] - places_mm[a], ac = places_mm[c] - places_mm[a];
    sum += (ab.y() * ac.x() - ab.x() * ac.y()) / 2;  // rows run downwards
  }
  return sum;
}

TEST(CornerVertices, EveryCornerWithFourCellsOfOnePanelIsAVertexOfACleanSheet) {
  const BoardPanels panels = TwoSheets();
  const auto sheet = MakePanelSheet(panels, kPitchMm, 10);
  ASSERT_TRUE(sheet.ok()) << sheet.status();
  const auto cells = static_cast<int>(sheet->cell_of_vertex.size());
  const CutSheet cut = CutAtCorners(*sheet, cells);

  std::set<std::pair<int, int>> expected, found;
  for (int row = 1; row < kTubeRows; ++row) {
    for (int col = 1; col < kTubeCols; ++col) {
      const int panel = panels.At(row, col);
      if (panel >= 0 && panels.At(row - 1, col) == panel && panels.At(row, col - 1) == panel &&
          panels.At(row - 1, col - 1) == panel) {
        expected.emplace(row, col);
      }
    }
  }
  for (const CornerVertex& corner : cut.corners) {
    EXPECT_TRUE(corner.node.IsCorner());
    found.emplace(corner.node.row, corner.node.col);
  }
  EXPECT_EQ(found, expected);
  EXPECT_EQ(found.size(), cut.corners.size());

  std::vector<Eigen::Vector3d> places_mm = sheet->flat.vertices_mm;
  for (const Eigen::Vector3d& place : CornerPlaces(*sheet, cut.corners, sheet->flat.vertices_mm)) {
    places_mm.push_back(place);
  }
  for (size_t i = 0; i < cut.corners.size(); ++i) {
    const Eigen::Vector2d on_board_mm = kPitchMm * cut.corners[i].node.PlaceInCells();
    EXPECT_LT((places_mm[cells + i].head<2>() - on_board_mm).norm(), 1e-9);
  }
  // The same surface: borders, orientation and area.
  const auto topology = CheckTopology(static_cast<int>(places_mm.size()), cut.faces);
  ASSERT_TRUE(topology.ok()) << topology.status();
  EXPECT_EQ(topology->loops, sheet->loops);
  EXPECT_EQ(topology->components, 2);
  EXPECT_NEAR(AreaMm2(cut.faces, places_mm), AreaMm2(sheet->flat.faces, sheet->flat.vertices_mm), 1e-6);
  EXPECT_EQ(cut.faces.size(), sheet->flat.faces.size() + 2 * cut.corners.size());
}

TEST(CornerVertices, LieOnTheBentSurfaceAndNotBesideIt) {
  const auto sheet = MakePanelSheet(TwoSheets(), kPitchMm, 10);
  ASSERT_TRUE(sheet.ok()) << sheet.status();
  constexpr double kRadiusMm = 15;
  const auto bent = [](const Eigen::Vector3d& flat_mm) {
    const double angle = (flat_mm.x() + 0.5 * flat_mm.y()) / kRadiusMm;
    return Eigen::Vector3d(kRadiusMm * std::sin(angle), flat_mm.y(), kRadiusMm * std::cos(angle));
  };
  std::vector<Eigen::Vector3d> places_mm;
  for (const Eigen::Vector3d& flat_mm : sheet->flat.vertices_mm) places_mm.push_back(bent(flat_mm));
  const CutSheet cut = CutAtCorners(*sheet, static_cast<int>(places_mm.size()));
  const std::vector<Eigen::Vector3d> corners_mm = CornerPlaces(*sheet, cut.corners, places_mm);
  double most_mm = 0, sum_mm = 0, sum_of_means_mm = 0;
  for (size_t i = 0; i < cut.corners.size(); ++i) {
    const Eigen::Vector2d on_board_mm = kPitchMm * cut.corners[i].node.PlaceInCells();
    const Eigen::Vector3d truth_mm = bent({on_board_mm.x(), on_board_mm.y(), 0});
    Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
    for (const int v : cut.corners[i].around) mean_mm += places_mm[v] / 4;
    most_mm = std::max(most_mm, (corners_mm[i] - truth_mm).norm());
    sum_mm += (corners_mm[i] - truth_mm).norm();
    sum_of_means_mm += (mean_mm - truth_mm).norm();
  }
  EXPECT_LT(10 * sum_mm, sum_of_means_mm);
  EXPECT_LT(most_mm, 0.05);  // beside borders, where the cells on one side are missing
}

TEST(BuildTemplate, CornersDoubleTheVerticesAndLeaveSeamsAndOpeningsAsTheyAre) {
  const testing::Tube tube = testing::FourPanels();
  TemplateBuildOptions options;
  options.openings = 2;
  const TemplateSources sources{{testing::Worn(testing::TubeCloud(tube), 0.1, 5, 0, 3)}, {}, {}};
  const auto plain = BuildTemplate(testing::PlainBoard(tube), sources, options);
  ASSERT_TRUE(plain.ok()) << plain.status();
  options.corners = true;
  const auto fine = BuildTemplate(testing::PlainBoard(tube), sources, options);
  ASSERT_TRUE(fine.ok()) << fine.status();

  const TriangleMesh &coarse_mesh = plain->garment.rest, &mesh = fine->garment.rest;
  const size_t before = coarse_mesh.vertices_mm.size(), after = mesh.vertices_mm.size();
  EXPECT_GT(after, 1.85 * static_cast<double>(before));
  ASSERT_EQ(fine->garment.node_of_vertex.size(), after);
  EXPECT_TRUE(
      std::equal(coarse_mesh.vertices_mm.begin(), coarse_mesh.vertices_mm.end(), mesh.vertices_mm.begin()));
  for (size_t v = 0; v < after; ++v) EXPECT_EQ(fine->garment.node_of_vertex[v].IsCorner(), v >= before);
  EXPECT_EQ(fine->parts.seams.size(), plain->parts.seams.size());
  const auto topology = CheckTopology(static_cast<int>(after), mesh.faces);
  ASSERT_TRUE(topology.ok()) << topology.status();
  EXPECT_EQ(topology->genus, 0);
  EXPECT_EQ(topology->components, 1);
  EXPECT_EQ(topology->loops, CheckTopology(static_cast<int>(before), coarse_mesh.faces)->loops);

  // Edges within panels are as long as on the print, in the texture and at rest.
  ASSERT_EQ(fine->parts.texture_mm.size(), after);
  EXPECT_LT(fine->strain.p95, 1.1 * plain->strain.p95 + 0.001);
  const GarmentParts& parts = fine->parts;
  for (int f = 0; f < parts.panel_faces; ++f) {
    for (int i = 0; i < 3; ++i) {
      const int a = mesh.faces[f][i], b = mesh.faces[f][(i + 1) % 3];
      const Eigen::Vector2d on_board =
          fine->garment.node_of_vertex[b].PlaceInCells() - fine->garment.node_of_vertex[a].PlaceInCells();
      EXPECT_NEAR((parts.texture_mm[b] - parts.texture_mm[a]).norm(), kPitchMm * on_board.norm(), 1e-9);
    }
  }

  // The second pass finds the same cells side by side, and evaluation the print on the panels' faces.
  const std::vector<CellNeighborhood> cells = FindCellNeighborhoods(plain->garment);
  const std::vector<CellNeighborhood> with_corners = FindCellNeighborhoods(fine->garment);
  EXPECT_TRUE(std::equal(cells.begin(), cells.end(), with_corners.begin()));
  for (size_t v = before; v < after; ++v) EXPECT_EQ(with_corners[v][4], -1);
  const ClothPrint print = PrintFromVertexNodes(mesh.faces, fine->garment.node_of_vertex);
  for (int f = 0; f < parts.panel_faces; ++f) EXPECT_FALSE(std::isnan(print.of_face[f][0].x()));
}

}  // namespace
}  // namespace weft
