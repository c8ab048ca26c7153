#include "alignment/template.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using ::testing::AllOf;
using testing::FlatSheet;
using ::testing::HasSubstr;

constexpr int kTemplateRows = 6, kTemplateCols = 8;

Board SomeBoard() {
  Board board;
  board.id = "b";
  board.rows = 12;
  board.cols = 10;
  board.cell_mm = 2.7;
  for (int i = 0; i < 120; ++i) board.cells.push_back(static_cast<CellColor>((i + i / 10) % kCellColors));
  return board;
}

// The sheet's vertices on the cells from (2, 1) on; the last vertex has none.
std::vector<VertexNode> SomeCells() {
  std::vector<VertexNode> cells;
  for (int r = 0; r < kTemplateRows; ++r) {
    for (int c = 0; c < kTemplateCols; ++c) cells.push_back({r + 2, c + 1});
  }
  cells.back() = {};
  return cells;
}

std::string ErrorOf(const TriangleMesh& mesh, const std::vector<VertexNode>& cells) {
  const auto garment = ImportTemplate("shirt", mesh, cells, SomeBoard());
  EXPECT_EQ(garment.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(garment.status().message());
}

TEST(ImportTemplate, JoinsMeshMapAndBoard) {
  const auto garment =
      ImportTemplate("shirt", FlatSheet(kTemplateRows, kTemplateCols), SomeCells(), SomeBoard());
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(garment->id, "shirt");
  EXPECT_EQ(garment->board_hash, SomeBoard().ContentHash());
  EXPECT_EQ(garment->node_of_vertex[9].row, 3);
  EXPECT_EQ(garment->node_of_vertex[9].col, 2);
  EXPECT_EQ(garment->node_of_vertex.back().row, -1);
}

TEST(ImportTemplate, RefusesMapsThatDoNotFitTheMeshAndSaysWhatToDo) {
  std::vector<VertexNode> cells = SomeCells();
  cells.pop_back();
  EXPECT_THAT(ErrorOf(FlatSheet(kTemplateRows, kTemplateCols), cells),
              AllOf(HasSubstr("the map has 47 entries and the mesh 48 vertices"), HasSubstr("-1 -1")));
}

TEST(ImportTemplate, RefusesCellsOffTheBoard) {
  std::vector<VertexNode> cells = SomeCells();
  cells[7] = {3, 10};
  EXPECT_THAT(ErrorOf(FlatSheet(kTemplateRows, kTemplateCols), cells),
              HasSubstr("vertex 7: cell (3, 10) is not on the board of 12 rows and 10 columns"));
}

TEST(ImportTemplate, RefusesCellsClaimedTwice) {
  std::vector<VertexNode> cells = SomeCells();
  cells[7] = cells[4];
  EXPECT_THAT(ErrorOf(FlatSheet(kTemplateRows, kTemplateCols), cells),
              HasSubstr("vertex 7: cell (2, 5) belongs to vertex 4"));
}

TEST(ImportTemplate, RefusesMapsWithoutAnyCell) {
  EXPECT_THAT(ErrorOf(FlatSheet(kTemplateRows, kTemplateCols),
                      std::vector<VertexNode>(kTemplateRows * kTemplateCols)),
              HasSubstr("gives no vertex a cell"));
}

TEST(ImportTemplate, NamesTheVertexOrFaceThatIsBroken) {
  TriangleMesh mesh = FlatSheet(kTemplateRows, kTemplateCols);
  mesh.vertices_mm[11].y() = NAN;
  EXPECT_THAT(ErrorOf(mesh, SomeCells()), HasSubstr("vertex 11: position is not finite"));
  mesh = FlatSheet(kTemplateRows, kTemplateCols);
  mesh.faces[5][1] = 48;
  EXPECT_THAT(ErrorOf(mesh, SomeCells()), HasSubstr("face 5: vertex 48"));
  mesh = FlatSheet(kTemplateRows, kTemplateCols);
  mesh.faces[6][2] = mesh.faces[6][0];
  EXPECT_THAT(ErrorOf(mesh, SomeCells()), HasSubstr("face 6: a vertex occurs twice"));
  mesh = FlatSheet(kTemplateRows, kTemplateCols);
  mesh.faces.push_back({0, 9, 47});  // the first square's diagonal has two faces
  EXPECT_THAT(ErrorOf(mesh, SomeCells()), HasSubstr("edge between vertices 0 and 9 has two faces already"));
}

TEST(ImportTemplate, RefusesMeshesWithoutFaces) {
  TriangleMesh mesh = FlatSheet(kTemplateRows, kTemplateCols);
  mesh.faces.clear();
  EXPECT_THAT(ErrorOf(mesh, SomeCells()), HasSubstr("the mesh has no faces"));
}

TEST(Template, HashTellsMeshMapAndBoardApart) {
  const Template garment =
      *ImportTemplate("shirt", FlatSheet(kTemplateRows, kTemplateCols), SomeCells(), SomeBoard());
  const std::string hash = garment.ContentHash();
  EXPECT_EQ(hash.size(), 16u);
  const auto after = [&](auto change) {
    Template changed = garment;
    change(changed);
    return changed.ContentHash();
  };
  EXPECT_EQ(after([](Template& t) { t.id = "other name"; }), hash);
  EXPECT_NE(after([](Template& t) { t.rest.vertices_mm[3].x() += 1e-6; }), hash);
  EXPECT_NE(after([](Template& t) { std::swap(t.rest.faces[0], t.rest.faces[1]); }), hash);
  EXPECT_NE(after([](Template& t) { t.node_of_vertex[2] = {}; }), hash);
  EXPECT_NE(after([](Template& t) { t.node_of_vertex[2].kind = NodeKind::kCorner; }), hash);
  EXPECT_NE(after([](Template& t) { t.board_hash = "0"; }), hash);
}

TEST(ParseVertexMap, ReadsALinePerVertex) {
  const auto cells = ParseVertexMap("3 4\r\n-1 -1\n 0\t7", NodeKind::kCenter, "map.txt");
  ASSERT_TRUE(cells.ok()) << cells.status();
  ASSERT_EQ(cells->size(), 3u);
  EXPECT_EQ((*cells)[0].col, 4);
  EXPECT_EQ((*cells)[1].row, -1);
  EXPECT_EQ((*cells)[2].col, 7);
}

TEST(ParseVertexMap, NamesFileLineAndRemedy) {
  for (const char* text : {"1 2\n3\n", "1 2\n3 4 5\n", "1 2\n3 x\n", "1 2\n\n3 4\n", "1 2\n3.5 4\n"}) {
    EXPECT_THAT(ParseVertexMap(text, NodeKind::kCenter, "map.txt").status().message(),
                AllOf(HasSubstr("map.txt:2: "), HasSubstr("expected `row col`, or `-1 -1`")))
        << text;
  }
  EXPECT_THAT(ParseVertexMap("-1 5\n", NodeKind::kCenter, "map.txt").status().message(),
              AllOf(HasSubstr("map.txt:1: "), HasSubstr("negative")));
  EXPECT_THAT(ParseVertexMap("", NodeKind::kCenter, "map.txt").status().message(),
              HasSubstr("map.txt: the map is empty"));
}

TEST(ImportTemplate, TakesCornersUpToTheBoardsEdgeOnce) {
  std::vector<VertexNode> nodes = SomeCells();
  nodes.back() = {12, 10, NodeKind::kCorner};  // the board's last
  const auto garment = ImportTemplate("shirt", FlatSheet(kTemplateRows, kTemplateCols), nodes, SomeBoard());
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_TRUE(garment->node_of_vertex.back().IsCorner());
  EXPECT_EQ(garment->node_of_vertex.back().PlaceInCells(), Eigen::Vector2d(10, 12));
  nodes.back() = {13, 10, NodeKind::kCorner};
  EXPECT_THAT(ErrorOf(FlatSheet(kTemplateRows, kTemplateCols), nodes),
              HasSubstr("corner (13, 10) is not on the board"));
  nodes.back() = nodes[3] = {4, 4, NodeKind::kCorner};
  EXPECT_THAT(ErrorOf(FlatSheet(kTemplateRows, kTemplateCols), nodes),
              HasSubstr("corner (4, 4) belongs to vertex 3 already"));
  std::fill(nodes.begin(), nodes.end(), VertexNode{});
  nodes[0] = {4, 4, NodeKind::kCorner};
  EXPECT_THAT(ErrorOf(FlatSheet(kTemplateRows, kTemplateCols), nodes), HasSubstr("gives no vertex a cell"));
}

TEST(JoinCorners, AVertexIsACellOrACorner) {
  std::vector<VertexNode> nodes = *ParseVertexMap("1 1\n-1 -1\n-1 -1\n", NodeKind::kCenter, "cells.txt");
  const auto corners = ParseVertexMap("-1 -1\n1 1\n-1 -1\n", NodeKind::kCorner, "corners.txt");
  ASSERT_TRUE(JoinCorners(*corners, &nodes).ok());
  EXPECT_TRUE(nodes[0].IsCell());
  EXPECT_TRUE(nodes[1].IsCorner());
  EXPECT_FALSE(nodes[2].IsCell() || nodes[2].IsCorner());
  EXPECT_THAT(JoinCorners(*ParseVertexMap("2 2\n-1 -1\n-1 -1\n", NodeKind::kCorner, ""), &nodes).message(),
              AllOf(HasSubstr("vertex 0: has cell (1, 1) and corner (2, 2), line 1"), HasSubstr("-1 -1")));
  EXPECT_THAT(JoinCorners({{}, {}}, &nodes).message(), HasSubstr("has 2 lines and that of cells 3"));
}

TEST(TargetsFromCloud, GivesCornersToTheirVertices) {
  std::vector<VertexNode> nodes = SomeCells();
  nodes.back() = {2, 1, NodeKind::kCorner};
  const Template garment =
      *ImportTemplate("shirt", FlatSheet(kTemplateRows, kTemplateCols), nodes, SomeBoard());
  Cloud cloud;
  cloud.points = {{{7, 7, 7}, {2, 1, NodeKind::kCorner}, 3, 0.3},
                  {{4, 5, 6}, {2, 1, NodeKind::kCenter}, 3, 0.3},   // vertex 0
                  {{0, 0, 0}, {3, 2, NodeKind::kCorner}, 3, 0.3}};  // no vertex; no cell is missing either
  const CloudTargets found = TargetsFromCloud(garment, cloud);
  EXPECT_EQ(found.unclaimed, 0);
  ASSERT_EQ(found.targets.size(), 2u);
  EXPECT_EQ(found.targets[0].vertex, 0);
  EXPECT_EQ(found.targets[1].vertex, static_cast<int>(nodes.size()) - 1);
  EXPECT_EQ(found.targets[1].position_mm, Eigen::Vector3d(7, 7, 7));
}

TEST(TargetsFromCloud, GivesEachPointToTheVertexOfItsCell) {
  const Template garment =
      *ImportTemplate("shirt", FlatSheet(kTemplateRows, kTemplateCols), SomeCells(), SomeBoard());
  Cloud cloud;
  cloud.points = {{{1, 2, 3}, {3, 2, NodeKind::kCenter}, 5, 0.2},    // vertex 9
                  {{0, 0, 0}, {0, 0, NodeKind::kCenter}, 4, 0.2},    // on the board, not in the garment
                  {{0, 0, 0}, {90, 90, NodeKind::kCenter}, 4, 0.2},  // not even on the board
                  {{4, 5, 6}, {2, 1, NodeKind::kCenter}, 3, 0.3},    // vertex 0
                  {{7, 7, 7}, {2, 1, NodeKind::kCorner}, 3, 0.3}};   // corners have no vertex
  const CloudTargets found = TargetsFromCloud(garment, cloud);
  EXPECT_EQ(found.unclaimed, 2);
  ASSERT_EQ(found.targets.size(), 2u);
  EXPECT_EQ(found.targets[0].vertex, 0);
  EXPECT_EQ(found.targets[0].views, 3);
  EXPECT_DOUBLE_EQ(found.targets[0].sigma_mm, 0.3);
  EXPECT_EQ(found.targets[1].vertex, 9);
  EXPECT_EQ(found.targets[1].position_mm, Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace weft
