#include "simulation/observation_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace weft {
namespace {

// A whole board of `side` cells in view; (row, col) at 10 px each.
ViewTruth Whole(int side) {
  ViewTruth out;
  out.camera_id = "c00";
  for (int row = 0; row < side; ++row) {
    for (int col = 0; col < side; ++col) {
      NodeTruth node;
      node.node = {row, col, NodeKind::kCenter};
      node.pixel_px = {10.0 * col, 10.0 * row};
      node.pitch_px = 10;
      node.facing_deg = 20;
      node.visible = true;
      out.nodes.push_back(node);
    }
  }
  return out;
}

TEST(ObservationModel, EdgesAreCountedInCellsOfTheBoard) {
  ViewTruth view = Whole(11);
  view.nodes[5 * 11 + 5].visible = false;
  const SeenCells cells = SightsOf(view);
  EXPECT_EQ(cells.at.size(), 120u);
  std::map<std::pair<int, int>, int> edge;
  for (size_t k = 0; k < cells.at.size(); ++k) {
    const BoardNode& node = view.nodes[cells.at[k]].node;
    edge[{node.row, node.col}] = cells.sight[k].edge_cells;
  }
  EXPECT_EQ((edge[{0, 5}]), 1);
  EXPECT_EQ((edge[{1, 5}]), 2);
  EXPECT_EQ((edge[{2, 5}]), 3);
  EXPECT_EQ((edge[{3, 5}]), 2);  // the hidden cell is nearer than the border
  EXPECT_EQ((edge[{4, 4}]), 1);
  EXPECT_FALSE(edge.contains({5, 5}));
}

TEST(ObservationModel, LargeCellsInPlainSightAreFoundAndSmallOnesAtEdgesLost) {
  const CellSight good = {10, 20, CellSight::kFarFromEdge};
  EXPECT_GT(FoundProbability(good), 0.97);
  EXPECT_LT(FoundProbability({3, 20, CellSight::kFarFromEdge}),
            FoundProbability({8, 20, CellSight::kFarFromEdge}));
  EXPECT_LT(FoundProbability({8, 20, 1}), FoundProbability({8, 20, CellSight::kFarFromEdge}));
  EXPECT_GT(ErrorSigmaPx({10, 20, 1}), ErrorSigmaPx(good));
  EXPECT_GT(ErrorSigmaPx(good), 0.01);
  EXPECT_LT(ErrorSigmaPx(good), 0.2);
}

TEST(ObservationModel, ImitationsHaveTheSharesAndErrorsOfTheModel) {
  const ViewTruth view = Whole(120);
  const std::vector<Observation> seen = ImitateDecoder(view, 7);
  double expected = 0;
  for (const CellSight& sight : SightsOf(view).sight) expected += FoundProbability(sight);
  const double cells = static_cast<double>(view.nodes.size());
  EXPECT_NEAR(static_cast<double>(seen.size()), expected, 4 * std::sqrt(cells * 0.25));
  double squares = 0;
  for (const Observation& o : seen)
    squares += (Eigen::Vector2d(o.x_px, o.y_px) - Eigen::Vector2d(10.0 * o.node.col, 10.0 * o.node.row))
                   .squaredNorm() /
               (2 * o.sigma_px * o.sigma_px);
  EXPECT_NEAR(squares / static_cast<double>(seen.size()), 1, 0.05);

  const std::vector<Observation> again = ImitateDecoder(view, 7), other = ImitateDecoder(view, 8);
  ASSERT_EQ(seen.size(), again.size());
  EXPECT_EQ(seen[5].x_px, again[5].x_px);
  EXPECT_NE(seen[5].x_px, other[5].x_px);
}

// Hiding a cell far away changes no other observation.
TEST(ObservationModel, CellsAreDrawnIndependently) {
  ViewTruth view = Whole(40);
  const std::vector<Observation> before = ImitateDecoder(view, 3);
  view.nodes.back().visible = false;
  std::map<BoardNode, double> after;
  for (const Observation& o : ImitateDecoder(view, 3)) after[o.node] = o.x_px;
  for (const Observation& o : before) {
    if (o.node.row > 30 || o.node.col > 30) continue;
    ASSERT_TRUE(after.contains(o.node));
    EXPECT_EQ(after[o.node], o.x_px);
  }
}

}  // namespace
}  // namespace weft
