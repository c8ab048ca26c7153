#include "capture/calibration/covisibility.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace weft {
namespace {

using ::testing::ElementsAre;

CalibrationViews ViewsBy(int cameras, const std::vector<std::array<int, 3>>& camera_frame_board) {
  CalibrationViews views;
  views.cameras.resize(static_cast<size_t>(cameras));
  for (const auto& [camera, frame, board] : camera_frame_board) {
    BoardView view;
    view.camera = camera, view.frame = frame, view.board = board;
    views.boards.push_back(view);
  }
  return views;
}

TEST(Covisibility, CountsBoardsAtOneMoment) {
  // Cameras 0 and 1 share two moments; 2 saw the same board later, and another board at the same time.
  const CalibrationViews views =
      ViewsBy(3, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 2, 0}, {2, 0, 1}});
  const Covisibility seen = CountSharedViews(views);
  EXPECT_THAT(seen.shared, ElementsAre(ElementsAre(2, 2, 0), ElementsAre(2, 2, 0), ElementsAre(0, 0, 2)));
  EXPECT_THAT(seen.groups, ElementsAre(ElementsAre(0, 1), ElementsAre(2)));
  EXPECT_THAT(SharedViews(views), ElementsAre(2, 2, 0));
}

TEST(Covisibility, ConnectsCamerasThroughOthersAndPutsTheLargestFirst) {
  const Covisibility seen =
      CountSharedViews(ViewsBy(5, {{1, 0, 0}, {3, 0, 0}, {3, 1, 0}, {4, 1, 0}, {0, 2, 0}}));
  EXPECT_THAT(seen.groups, ElementsAre(ElementsAre(1, 3, 4), ElementsAre(0), ElementsAre(2)));
}

}  // namespace
}  // namespace weft
