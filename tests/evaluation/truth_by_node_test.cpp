#include "evaluation/truth_by_node.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

// A flat sheet of rows x cols cells, 10 mm apart, its vertices numbered along rows or along columns.
Template Sheet(int rows, int cols, bool along_rows) {
  Template sheet;
  sheet.board_hash = "b0a4d";
  const auto vertex = [&](int r, int c) { return along_rows ? r * cols + c : c * rows + r; };
  sheet.rest.vertices_mm.resize(rows * cols);
  sheet.node_of_vertex.resize(rows * cols);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      sheet.rest.vertices_mm[vertex(r, c)] = {10.0 * c, 10.0 * r, 0};
      sheet.node_of_vertex[vertex(r, c)] = {r, c, NodeKind::kCenter};
      if (r + 1 == rows || c + 1 == cols) continue;
      sheet.rest.faces.push_back({vertex(r, c), vertex(r + 1, c), vertex(r, c + 1)});
      sheet.rest.faces.push_back({vertex(r, c + 1), vertex(r + 1, c), vertex(r + 1, c + 1)});
    }
  }
  return sheet;
}

TEST(TruthByNode, VerticesOfAnotherOrderFindTheirCells) {
  const Template truth = Sheet(3, 4, true), result = Sheet(3, 4, false);
  EXPECT_TRUE(HaveSameVertices(truth, truth));
  EXPECT_FALSE(HaveSameVertices(result, truth));
  const auto by_node = TruthByNode::Build(result, truth);
  ASSERT_TRUE(by_node.ok()) << by_node.status();
  EXPECT_EQ(by_node->matched(), 12);
  const std::vector<Eigen::Vector3d> positions_mm = by_node->Positions(truth.rest.vertices_mm);
  for (size_t v = 0; v < positions_mm.size(); ++v) EXPECT_EQ(positions_mm[v], result.rest.vertices_mm[v]);
}

TEST(TruthByNode, CornersLieOnTheTrueClothAndCellsBesideItNowhere) {
  const Template truth = Sheet(3, 3, true);
  Template result = Sheet(3, 4, false);  // its last column is not on the true cloth
  result.node_of_vertex[0] = {1, 1, NodeKind::kCorner};
  result.node_of_vertex[1] = {-1, -1, NodeKind::kCenter};  // a seam
  const auto by_node = TruthByNode::Build(result, truth);
  ASSERT_TRUE(by_node.ok()) << by_node.status();
  const std::vector<Eigen::Vector3d> positions_mm = by_node->Positions(truth.rest.vertices_mm);
  EXPECT_LT((positions_mm[0] - Eigen::Vector3d(5, 5, 0)).norm(), 1e-9);
  EXPECT_TRUE(std::isnan(positions_mm[1].x()));
  for (const size_t v : {9, 10, 11}) EXPECT_TRUE(std::isnan(positions_mm[v].x())) << v;
  EXPECT_EQ(by_node->matched(), 8);
}

TEST(TruthByNode, ViewsAreCountedByNode) {
  const Template truth = Sheet(2, 2, true);
  const auto by_node = TruthByNode::Build(Sheet(2, 2, false), truth);
  ASSERT_TRUE(by_node.ok()) << by_node.status();
  FrameTruth frame;
  for (const bool scoreable : {true, true, false}) {
    NodeTruth node;
    node.node = {0, 1, NodeKind::kCenter};  // vertex 1 of the truth, vertex 2 of the result
    node.scoreable = scoreable;
    frame.views.push_back({"c", {node}});
  }
  EXPECT_EQ(by_node->ScoreableViews(frame), (std::vector<int>{0, 0, 2, 0}));
}

TEST(TruthByNode, OtherBoardsAndOtherPartsAreRefused) {
  const Template truth = Sheet(2, 2, true);
  Template other = Sheet(2, 2, false);
  other.board_hash = "07e4";
  const absl::Status board = TruthByNode::Build(other, truth).status();
  EXPECT_EQ(board.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(board.message().find("07e4"), std::string::npos);
  EXPECT_NE(board.message().find("b0a4d"), std::string::npos);
  other.board_hash = truth.board_hash;
  for (VertexNode& node : other.node_of_vertex) node.row += 50;
  EXPECT_EQ(TruthByNode::Build(other, truth).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace weft
