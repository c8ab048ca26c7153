// FootprintOptions::neighbor_share is what the decoder leaves: this bounds it on rendered views.
#include <gtest/gtest.h>

#include <map>
#include <tuple>
#include <vector>

#include "pattern/decoder.h"
#include "simulation/take_presets.h"
#include "triangulation/footprint.h"

namespace weft {
namespace {

using Place = std::pair<int, int>;

// Sums of the regression of errors on bends over the cells of a view: a decoded centre is off by `share`
// times the way from the cell to the mean of its four neighbours.
struct Regression {
  double bend_error = 0, bend_bend = 0;
  size_t cells = 0;
};

void Add(const std::vector<Observation>& observations, const ViewTruth& truth, Regression& sums) {
  std::map<Place, Eigen::Vector2d> is_at;
  for (const NodeTruth& node : truth.nodes) {
    if (node.scoreable && node.node.kind == NodeKind::kCenter)
      is_at[{node.node.row, node.node.col}] = node.pixel_px;
  }
  for (const Observation& o : observations) {
    const auto [row, col, kind] = o.node;
    const auto here = is_at.find({row, col});
    if (kind != NodeKind::kCenter || here == is_at.end()) continue;
    Eigen::Vector2d around = Eigen::Vector2d::Zero();
    int known = 0;
    for (const auto& [dr, dc] : {Place{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
      const auto near = is_at.find({row + dr, col + dc});
      if (near == is_at.end()) continue;
      around += near->second;
      ++known;
    }
    if (known < 4) continue;
    const Eigen::Vector2d bend = around / 4 - here->second;
    const Eigen::Vector2d error = Eigen::Vector2d(o.x_px, o.y_px) - here->second;
    if (error.norm() > 1) continue;
    sums.bend_error += bend.dot(error);
    sums.bend_bend += bend.squaredNorm();
    ++sums.cells;
  }
}

TEST(FootprintOfTheDecoder, IsNearTheShareThatTriangulationTakesOut) {
  SyntheticTakeOptions options = *SyntheticPreset("quickstart", 3);
  options.performance.frames = 1;
  absl::StatusOr<SyntheticTake> take = SyntheticTake::Make(options);
  ASSERT_TRUE(take.ok()) << take.status();
  const absl::StatusOr<TakeFrame> frame = take->Next();
  ASSERT_TRUE(frame.ok()) << frame.status();
  const absl::StatusOr<BoardIndex> board = BoardIndex::Build(take->board());
  ASSERT_TRUE(board.ok()) << board.status();
  Regression sums;
  for (const int camera : {0, 5, 10}) {
    const absl::StatusOr<FilmedView> view = take->Film(*frame, camera);
    ASSERT_TRUE(view.ok() && view->picture);
    const auto result = DecodeView(ToFrame(*view->picture), *board, {});
    ASSERT_TRUE(result.ok()) << result.status();
    Add(result->observations, view->truth, sums);
  }
  ASSERT_GT(sums.cells, 5000u);
  // It varies with the way of folding and the renderer: single views of two such scenes lie between -0.03 and
  // 0.04, three views together between -0.01 and 0.02; pictures of another renderer are off least when 0.06
  // is taken out. A decoder that averages over its cell leaves 0.2 and more.
  EXPECT_NEAR(sums.bend_error / sums.bend_bend, FootprintOptions().neighbor_share / 2, 0.06);
}

}  // namespace
}  // namespace weft
