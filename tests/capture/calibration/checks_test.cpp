#include "capture/calibration/checks.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>

#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

MATCHER_P3(Issue, fault, cameras, text, "") {
  *result_listener << CalibrationFaultName(arg.fault) << ": " << arg.message;
  return arg.fault == fault && arg.cameras == std::vector<int>(cameras) &&
         arg.message.find(text) != std::string::npos;
}

class CalibrationChecks : public ::testing::Test {
 protected:
  std::vector<CalibrationIssue> Check(const std::vector<CameraSightings>& sightings = {}) const {
    return CheckViews(truth_.moved.target, truth_.views, sightings, {});
  }
  SimulatedCalibration truth_ = Simulate(6, 72, 0.1, 1.5);
};

TEST_F(CalibrationChecks, GoodViewsPass) { EXPECT_THAT(Check(), IsEmpty()); }

TEST_F(CalibrationChecks, ACameraThatSawNothingIsNamed) {
  std::erase_if(truth_.views.boards, [](const BoardView& view) { return view.camera == 2; });
  std::vector<CameraSightings> sightings(6);
  sightings[2].images = 72;
  EXPECT_THAT(Check(sightings), ElementsAre(Issue(CalibrationFault::kCameraUnseen, std::vector{2},
                                                  "camera c02: saw no board in 72 images")));
}

TEST_F(CalibrationChecks, MirroredImagesAreNotTakenForAbsence) {
  std::erase_if(truth_.views.boards, [](const BoardView& view) { return view.camera == 2; });
  std::vector<CameraSightings> sightings(6);
  sightings[2].mirrored = true;
  EXPECT_THAT(Check(sightings), ElementsAre(Issue(CalibrationFault::kMirroredImages, std::vector{2},
                                                  "camera c02: its images are mirrored")));
}

TEST_F(CalibrationChecks, BlurredTagsAreTheCauseAndNotAbsence) {
  std::erase_if(truth_.views.boards, [](const BoardView& view) { return view.camera == 4; });
  std::vector<CameraSightings> sightings(6);
  sightings[4] = {.images = 72, .tags = 10, .blurred_tags = 340, .blurred_px = 3.2};
  EXPECT_THAT(Check(sightings),
              ElementsAre(Issue(CalibrationFault::kBlurred, std::vector{4},
                                "camera c04: 340 of 350 tags are blurred (typically 3.2 px)")));
}

TEST_F(CalibrationChecks, ACameraWithoutTagsIsBlurredOnlyWhereWhatMovesIs) {
  std::erase_if(truth_.views.boards, [](const BoardView& view) { return view.camera == 1; });
  std::vector<CameraSightings> sightings(6);
  sightings[1] = {.images = 72, .moving_edge_px = 3.1};
  EXPECT_THAT(Check(sightings), ElementsAre(Issue(CalibrationFault::kBlurred, std::vector{1},
                                                  "no tag can be read in 72 images, they are too blurred")));
  sightings[1].moving_edge_px = 0.7;
  EXPECT_THAT(Check(sightings), ElementsAre(Issue(CalibrationFault::kCameraUnseen, std::vector{1},
                                                  "though something moves there and is sharp")));
}

TEST_F(CalibrationChecks, AMirroredBoardIsNamed) {
  TagBoard& board = truth_.moved.target.boards[1];
  for (int row = 0; row < board.rows; ++row) {
    std::reverse(board.tag_ids.begin() + row * board.cols, board.tag_ids.begin() + (row + 1) * board.cols);
  }
  // What the camera sees of a tag now belongs to another place of the board.
  for (BoardView& view : truth_.views.boards) {
    if (view.board != 1) continue;
    for (BoardCorner& corner : view.corners) {
      const int tag = corner.index / 4, col = tag % board.cols;
      corner.index += 4 * (board.cols - 1 - 2 * col);
    }
  }
  EXPECT_THAT(Check(), ElementsAre(Issue(CalibrationFault::kMirroredBoard, std::vector<int>{},
                                         "board B: mirrored in")));
}

TEST_F(CalibrationChecks, ABoardOfOtherRowsAndColumnsIsNamed) {
  std::swap(truth_.moved.target.boards[0].rows, truth_.moved.target.boards[0].cols);
  EXPECT_THAT(Check(), ElementsAre(Issue(CalibrationFault::kWrongLayout, std::vector<int>{},
                                         "board A: its tags do not lie")));
}

TEST_F(CalibrationChecks, TwoDisconnectedGroupsAreNamedOnce) {
  std::erase_if(truth_.views.boards,
                [](const BoardView& view) { return (view.camera < 2) != (view.frame < 36); });
  EXPECT_THAT(Check(), ElementsAre(Issue(CalibrationFault::kDisconnected, (std::vector{0, 1}),
                                         "cameras c00, c01 share no board with cameras c02, c03, c04, c05")));
}

TEST_F(CalibrationChecks, TooFewViewsAreCounted) {
  int left = 4;
  std::erase_if(truth_.views.boards, [&](const BoardView& view) { return view.camera == 1 && left-- <= 0; });
  EXPECT_THAT(Check(), ElementsAre(Issue(CalibrationFault::kTooFewViews, std::vector{1},
                                         "camera c01: 4 views of boards")));
}

TEST_F(CalibrationChecks, ViewsThatNoOtherCameraSharesDoNotCount) {
  std::map<std::pair<int, int>, bool> seen_by_first;
  for (const BoardView& view : truth_.views.boards) {
    if (view.camera == 0 && seen_by_first.size() + 3 < 20) seen_by_first[{view.frame, view.board}] = true;
  }
  int kept = 0;
  std::erase_if(truth_.views.boards, [&](const BoardView& view) {
    if (view.camera == 0) return !seen_by_first.contains({view.frame, view.board}) && ++kept > 3;
    return seen_by_first.contains({view.frame, view.board});
  });
  EXPECT_THAT(Check(),
              ElementsAre(Issue(CalibrationFault::kTooFewViews, std::vector{0}, "camera c00: shares")));
}

TEST_F(CalibrationChecks, BarePartsOfTheImageAreNamed) {
  for (BoardView& view : truth_.views.boards) {
    if (view.camera != 3) continue;
    std::erase_if(view.corners, [&](const BoardCorner& c) {
      return c.pixel_px.x() > truth_.views.cameras[3].width_px / 3.0 ||
             c.pixel_px.y() > truth_.views.cameras[3].height_px * 0.6;
    });
  }
  std::erase_if(truth_.views.boards, [](const BoardView& view) { return view.corners.empty(); });
  EXPECT_THAT(Check(), ElementsAre(Issue(CalibrationFault::kPoorCoverage, std::vector{3},
                                         "leave the top right, right, bottom left, bottom, bottom right")));
}

TEST_F(CalibrationChecks, WrongTagSizeShowsAgainstAScaleBar) {
  truth_ = Simulate(6, 72, 0.1, 1.5, {{"bar", "tag36h11", 500, 501, 300}});
  for (TagBoard& board : truth_.moved.target.boards) board.tag_mm *= 1.03, board.gap_mm *= 1.03;
  const auto solution = SolveCalibration(truth_.moved.target, truth_.views, std::nullopt, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_THAT(
      CheckSolution(truth_.moved.target, *solution, false, {}),
      ElementsAre(Issue(CalibrationFault::kWrongScale, std::vector<int>{}, "printed at 97.09 % of tag_mm")));
  EXPECT_THAT(CheckSolution(truth_.moved.target, *solution, true, {}), IsEmpty());
}

TEST_F(CalibrationChecks, ACameraThatWasMovedWhileRecordingIsNamed) {
  // From the middle of the recording on, camera 5 looks from elsewhere.
  Rig moved = truth_.rig;
  moved.cameras[5].translation_mm += Eigen::Vector3d(15, 0, 0);
  const CalibrationViews later = SeeTarget(truth_.moved, moved, {.noise_px = 0.1});
  std::erase_if(truth_.views.boards,
                [](const BoardView& view) { return view.camera == 5 && view.frame >= 36; });
  for (const BoardView& view : later.boards) {
    if (view.camera == 5 && view.frame >= 36) truth_.views.boards.push_back(view);
  }
  const auto solution = SolveCalibration(truth_.moved.target, truth_.views, std::nullopt, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_THAT(CheckSolution(truth_.moved.target, *solution, false, {}),
              ElementsAre(Issue(CalibrationFault::kHighResidual, std::vector{5}, "camera c05")));
}

// A point of the picture after it was turned upside down: tags are still read.
void TurnPictures(SimulatedCalibration& truth, int camera, int first, int last) {
  const CalibrationCamera& size = truth.views.cameras[static_cast<size_t>(camera)];
  for (BoardView& view : truth.views.boards) {
    if (view.camera != camera || view.frame < first || view.frame > last) continue;
    for (BoardCorner& corner : view.corners)
      corner.pixel_px = Eigen::Vector2d(size.width_px - 1, size.height_px - 1) - corner.pixel_px;
  }
}

TEST_F(CalibrationChecks, ACameraThatWasTurnedForAWhileIsNamedWithTheMoment) {
  const struct { int camera, first, last; } kCases[] = {{3, 36, 71}, {3, 0, 20}, {0, 50, 71}, {5, 24, 47}};
  int refused = 0;
  for (const auto& [camera, first, last] : kCases) {
    SimulatedCalibration truth = Simulate(6, 72, 0.1, 1.5);
    TurnPictures(truth, camera, first, last);
    const auto solution = SolveCalibration(truth.moved.target, truth.views, std::nullopt, {});
    if (!solution.ok()) {
      // Too little of it is left: refused before there is anything to check.
      EXPECT_TRUE(absl::IsFailedPrecondition(solution.status())) << solution.status();
      ++refused;
      continue;
    }
    const std::vector<CalibrationIssue> issues = CheckSolution(truth.moved.target, *solution, false, {});
    ASSERT_FALSE(issues.empty()) << "camera " << camera << " from " << first;
    for (const CalibrationIssue& issue : issues) {
      EXPECT_EQ(issue.cameras, std::vector{camera}) << issue.message;
      EXPECT_THAT(issue.message, HasSubstr("from frame "));
    }
  }
  EXPECT_LE(refused, 1);
}

TEST_F(CalibrationChecks, TheMomentIsThatOfTheTurn) {
  TurnPictures(truth_, 3, 36, 71);
  const auto solution = SolveCalibration(truth_.moved.target, truth_.views, std::nullopt, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  int first = 1000, last = -1;
  for (const SharedViewFate& fate : solution->shared_views) {
    if (fate.camera != 3 || !fate.is_rejected) continue;
    first = std::min(first, fate.frame), last = std::max(last, fate.frame);
  }
  EXPECT_GE(first, 36);
  EXPECT_LE(first, 44);
  EXPECT_GE(last, 63);
}

TEST_F(CalibrationChecks, NoMomentOfAGoodRecordingIsBlamed) {
  for (uint64_t seed = 1; seed < 4; ++seed) {
    const SimulatedCalibration truth = Simulate(8, 60, 0.15, 2, {}, seed);
    const auto solution = SolveCalibration(truth.moved.target, truth.views, std::nullopt, {});
    ASSERT_TRUE(solution.ok()) << solution.status();
    EXPECT_THAT(CheckSolution(truth.moved.target, *solution, false, {}), IsEmpty());
  }
}

// Small and tilted tags are read worse than the others: some px of a camera of which most are read to 0.03
// px.
TEST_F(CalibrationChecks, ViewsThatAreReadWorseAreNoChange) {
  SimulatedCalibration truth = Simulate(8, 60, 0.03, 2);
  uint64_t state = 1;
  for (size_t i = 0; i < truth.views.boards.size(); i += 3) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const double angle = static_cast<double>(state >> 40);
    for (BoardCorner& corner : truth.views.boards[i].corners)
      corner.pixel_px +=
          0.4 * Eigen::Vector2d(std::cos(angle + corner.index), std::sin(angle + corner.index));
  }
  const auto solution = SolveCalibration(truth.moved.target, truth.views, std::nullopt, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  int rejected = 0, far = 0;
  for (const SharedViewFate& fate : solution->shared_views) rejected += fate.is_rejected, far += fate.is_far;
  EXPECT_GT(rejected, 40);
  EXPECT_EQ(far, 0);
  for (const CalibrationIssue& issue : CheckSolution(truth.moved.target, *solution, false, {}))
    EXPECT_NE(issue.fault, CalibrationFault::kChanged) << issue.message;
}

TEST_F(CalibrationChecks, ATargetInAnotherUnitIsNamed) {
  // Inches pass for small tags, and show in where the cameras are.
  for (TagBoard& board : truth_.moved.target.boards) board.tag_mm /= 25.4, board.gap_mm /= 25.4;
  for (TagBoard& board : truth_.moved.target.boards) board.tag_mm *= 4, board.gap_mm *= 4;
  const auto solution = SolveCalibration(truth_.moved.target, truth_.views, std::nullopt, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  CalibrationSolution small = *solution;
  for (BoardPlacement& placement : small.bundle.placements) placement.world_from_board.translation_mm /= 4;
  for (CameraModel& camera : small.bundle.cameras) camera.translation_mm /= 4;
  EXPECT_THAT(CheckSolution(truth_.moved.target, small, false, {}),
              Contains(Issue(CalibrationFault::kWrongUnit, std::vector<int>{}, "Lengths are in mm")));
}

TEST_F(CalibrationChecks, AllIssuesComeInOneError) {
  EXPECT_TRUE(IssuesStatus({}).ok());
  const absl::Status status = IssuesStatus(
      {{CalibrationFault::kDisconnected, {1}, "first"}, {CalibrationFault::kBlurred, {2}, "second"}});
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("first"), HasSubstr("second")));
}

}  // namespace
}  // namespace weft
