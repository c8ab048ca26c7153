#include "evaluation/vertex_views.h"

#include <gtest/gtest.h>

#include <vector>

namespace weft {
namespace {

TEST(ReadAround, MostOfTheCellsAroundACellOrACornerWereRead) {
  std::vector<Observation> read;
  for (const auto& [row, col] : {std::pair(4, 4), {4, 5}, {5, 4}, {3, 4}, {4, 3}})
    read.push_back({0, 0, {row, col, NodeKind::kCenter}, 0.1f, 1});
  read.push_back({0, 0, {6, 6, NodeKind::kCorner}, 0.1f, 1});
  const std::vector<VertexNode> nodes = {
      {4, 4}, {5, 5}, {5, 5, NodeKind::kCorner}, {6, 6, NodeKind::kCorner}, {}};
  EXPECT_EQ(ReadAround(nodes, read), (std::vector<bool>{true, false, true, false, false}));
}

}  // namespace
}  // namespace weft
