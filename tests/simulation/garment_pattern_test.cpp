#include "simulation/garment_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "alignment/untangle/self_intersection.h"
#include "simulation/wardrobe.h"
#include "simulation/worn_garment.h"

namespace weft {
namespace {

// Each directed edge of a mesh and how often it occurs.
std::map<std::pair<int, int>, int> DirectedEdges(const std::vector<Face>& faces) {
  std::map<std::pair<int, int>, int> edges;
  for (const Face& f : faces)
    for (int k = 0; k < 3; ++k) ++edges[{f[k], f[(k + 1) % 3]}];
  return edges;
}

// Lengths in edges of the closed borders.
std::vector<int> BorderLoops(const std::vector<Face>& faces) {
  const auto edges = DirectedEdges(faces);
  std::map<int, int> next;
  for (const auto& [edge, count] : edges)
    if (!edges.count({edge.second, edge.first})) {
      EXPECT_FALSE(next.count(edge.first)) << "borders meet in vertex " << edge.first;
      next[edge.first] = edge.second;
    }
  std::vector<int> loops;
  while (!next.empty()) {
    int length = 0;
    for (int at = next.begin()->first; next.count(at); ++length) {
      const int to = next[at];
      next.erase(at);
      at = to;
    }
    loops.push_back(length);
  }
  return loops;
}

int Euler(const TriangleMesh& mesh) {
  std::set<std::pair<int, int>> edges;
  for (const Face& f : mesh.faces)
    for (int k = 0; k < 3; ++k) edges.insert(std::minmax(f[k], f[(k + 1) % 3]));
  return static_cast<int>(mesh.vertices_mm.size()) - static_cast<int>(edges.size()) +
         static_cast<int>(mesh.faces.size());
}

void ExpectSound(const Garment& garment) {
  for (const auto& [edge, count] : DirectedEdges(garment.rest.faces))
    ASSERT_EQ(count, 1) << "edge " << edge.first << " " << edge.second << " is not that of two faces alike";
  std::set<std::pair<int, int>> cells;
  for (const VertexNode& cell : garment.cell_of_vertex) {
    if (cell.row < 0) continue;
    EXPECT_TRUE(cells.insert({cell.row, cell.col}).second);
    EXPECT_LT(cell.row, garment.board_rows);
    EXPECT_LT(cell.col, garment.board_cols);
  }
  // Seen from outside the print is the right way round, and the board's own pitch is kept.
  for (size_t f = 0; f < garment.rest.faces.size(); ++f) {
    const auto& p = garment.print.of_face[f];
    const BoardPoint e1 = p[1] - p[0], e2 = p[2] - p[0];
    EXPECT_LT(e1.x() * e2.y() - e1.y() * e2.x(), 0);
    for (int k = 0; k < 3; ++k) {
      const VertexNode& cell = garment.cell_of_vertex[garment.rest.faces[f][k]];
      if (cell.row < 0) continue;
      EXPECT_EQ(p[k], BoardPoint(cell.col + 0.5, cell.row + 0.5));
    }
  }
}

TEST(GarmentPattern, TShirtIsOnePieceWithFourOpenings) {
  const auto outfit = MakeTShirt(12);
  ASSERT_TRUE(outfit.ok()) << outfit.status();
  const Garment& garment = outfit->sewn.garment;
  ExpectSound(garment);
  EXPECT_EQ(BorderLoops(garment.rest.faces).size(), 4u);  // neck, hem, two cuffs
  EXPECT_EQ(Euler(garment.rest), 2 - 4);
  EXPECT_TRUE(FindSelfIntersections(outfit->start_mm, garment.rest.faces).empty());
}

TEST(GarmentPattern, SkirtIsOnePieceWithTwoOpenings) {
  const auto outfit = MakeSkirt(12);
  ASSERT_TRUE(outfit.ok()) << outfit.status();
  ExpectSound(outfit->sewn.garment);
  EXPECT_EQ(BorderLoops(outfit->sewn.garment.rest.faces).size(), 2u);
  EXPECT_EQ(Euler(outfit->sewn.garment.rest), 0);
  EXPECT_TRUE(FindSelfIntersections(outfit->start_mm, outfit->sewn.garment.rest.faces).empty());
}

// A template knows the cells of its vertices alone, and so nothing of the print beside seams.
TEST(GarmentPattern, PrintIsKnownByTheFaces) {
  const auto shirt = MakeTShirt(20), skirt = MakeSkirt(20);
  ASSERT_TRUE(shirt.ok() && skirt.ok());
  for (const Garment* garment : {&shirt->sewn.garment, &skirt->sewn.garment}) {
    const std::vector<Face>& faces = garment->rest.faces;
    const std::optional<ClothPrint> print = PrintOfWorn(faces, 20);
    ASSERT_TRUE(print);
    const ClothPrint inner = PrintFromVertexNodes(faces, garment->cell_of_vertex);
    size_t beside_seams = 0;
    for (size_t f = 0; f < faces.size(); ++f) {
      EXPECT_FALSE(std::isnan(print->of_face[f][0].x()));
      const bool is_inner = !std::isnan(inner.of_face[f][0].x());
      beside_seams += is_inner ? 0 : 1;
      if (is_inner) {
        EXPECT_EQ(print->of_face[f], inner.of_face[f]);
      }
    }
    EXPECT_GT(beside_seams, faces.size() / 10);
  }
  EXPECT_FALSE(PrintOfWorn(shirt->sewn.garment.rest.faces, 19));
}

TEST(GarmentPattern, SewnEdgesAreEquallyLong) {
  for (const std::vector<Panel>& panels : {TShirtPanels(6), SkirtPanels()}) {
    std::map<std::string, std::vector<double>> lengths;
    for (const Panel& panel : panels)
      for (const PanelEdge& edge : panel.outline) lengths[edge.seam].push_back(LengthMm(edge.path_mm));
    for (const auto& [seam, both] : lengths) {
      if (both.size() == 1) continue;
      ASSERT_EQ(both.size(), 2u) << seam;
      EXPECT_NEAR(both[0] / both[1], 1, 1e-6) << seam;
    }
  }
}

TEST(GarmentPattern, CellsFillThePanels) {
  // As many cells as the real shirt of the paper has (98,618 of 2.7 mm), and few vertices besides.
  const auto sewn = SewPanels(TShirtPanels(2.7), 2.7);
  ASSERT_TRUE(sewn.ok()) << sewn.status();
  const auto& cells = sewn->garment.cell_of_vertex;
  const auto with_cell =
      std::count_if(cells.begin(), cells.end(), [](const VertexNode& c) { return c.row >= 0; });
  EXPECT_NEAR(static_cast<double>(with_cell), 98618, 8000);
  EXPECT_LT(static_cast<double>(cells.size() - with_cell), 0.03 * static_cast<double>(with_cell));
}

TEST(GarmentPattern, FineGarmentLiesOnACoarseOneOfTheSamePanels) {
  const auto coarse = MakeSkirt(16), fine = MakeSkirt(8);
  ASSERT_TRUE(coarse.ok() && fine.ok());
  const std::vector<Eigen::Vector3d> on = PositionsOn(coarse->sewn, coarse->start_mm, fine->sewn);
  ASSERT_EQ(on.size(), fine->start_mm.size());
  // Both are spread on the same smooth surface; chords of 16 mm leave it by half a millimetre.
  for (size_t v = 0; v < on.size(); ++v) EXPECT_LT((on[v] - fine->start_mm[v]).norm(), 1) << "vertex " << v;
}

TEST(GarmentPattern, WhatCannotBeSewnIsNamed) {
  std::vector<Panel> panels = SkirtPanels();
  panels[1].outline[0].from = "elsewhere";
  EXPECT_NE(SewPanels(panels, 12).status().message().find("side_L"), std::string::npos);
  EXPECT_NE(SewPanels(SkirtPanels(), 400).status().message().find("front"), std::string::npos);
  EXPECT_NE(SewPanels(SkirtPanels(), 0).status().message().find("cell_mm"), std::string::npos);
}

}  // namespace
}  // namespace weft
