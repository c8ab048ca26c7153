#include "capture/calibration/solve_calibration.h"

#include <gmock/gmock.h>
#include <tbb/task_arena.h>

#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(SolveCalibration, EightCamerasComeOutWithinTheirSigmas) {
  const SimulatedCalibration truth = Simulate(8, 60, 0.1);
  const auto solved = SolveCalibration(truth.moved.target, truth.views, std::nullopt, {});
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_TRUE(solved->converged);
  EXPECT_NEAR(solved->rms_px, 0.1, 0.005);
  EXPECT_NEAR(solved->variance_factor, 1, 0.05);
  const ErrorsAndSigmas compared = Compare(*solved, truth);
  EXPECT_LT(std::abs(compared.sigmas_off()), 4) << compared.per_freedom();
  for (int c = 0; c < 8; ++c) {
    // 15 unknowns: more than 45 has a chance of 1e-4.
    EXPECT_LT(compared.ChiSquareOf(15 * c, 15), 45) << "camera " << c;
    EXPECT_LT(solved->cameras[c].projection_sigma_px, 0.1);
  }
}

TEST(SolveCalibration, MixedFocalLengthsAndFarPrincipalPointsNeedNoFirstRig) {
  for (const double noise_px : {0.02, 0.2}) {
    const SimulatedCalibration truth = Simulate(24, 48, noise_px, 4.5);
    const auto solved = SolveCalibration(truth.moved.target, truth.views, std::nullopt, {});
    ASSERT_TRUE(solved.ok()) << solved.status();
    EXPECT_NEAR(solved->rms_px / noise_px, 1, 0.05);
    const ErrorsAndSigmas compared = Compare(*solved, truth);
    const double ratio = LikelihoodRatio(*solved, truth);
    EXPECT_LT(std::abs(ratio - compared.freedom), 4 * std::sqrt(2 * compared.freedom)) << noise_px;
    for (int c = 0; c < 24; ++c) {
      // 6 unknowns: more than 30 has a chance of 4e-5.
      EXPECT_LT(compared.ChiSquareOf(15 * c + 9, 6), 30) << "pose of camera " << c << " at " << noise_px;
    }
  }
}

TEST(SolveCalibration, TheSameAtAnyNumberOfThreads) {
  const SimulatedCalibration truth = Simulate(4, 30, 0.1);
  const auto hash = [&](int threads) {
    tbb::task_arena arena(threads);
    Rig rig;
    arena.execute([&] {
      rig.cameras =
          SolveCalibration(truth.moved.target, truth.views, std::nullopt, {}).value().bundle.cameras;
    });
    return rig.ContentHash();
  };
  EXPECT_EQ(hash(1), hash(3));
}

TEST(SolveCalibration, WrongCornersAreRejected) {
  SimulatedCalibration truth = Simulate(6, 50, 0.1);
  int wrong = 0;
  for (size_t v = 0; v < truth.views.boards.size(); v += 7) {
    for (size_t k = 0; k < truth.views.boards[v].corners.size(); k += 9, ++wrong) {
      truth.views.boards[v].corners[k].pixel_px += Eigen::Vector2d(9, -14);
    }
  }
  const auto solved = SolveCalibration(truth.moved.target, truth.views, std::nullopt, {});
  ASSERT_TRUE(solved.ok()) << solved.status();
  int rejected = 0;
  for (const CameraFit& fit : solved->cameras) rejected += fit.rejected_corners;
  EXPECT_GE(rejected, wrong);
  EXPECT_LT(rejected, wrong + wrong / 20 + 5);
  EXPECT_LT(std::abs(Compare(*solved, truth).sigmas_off()), 4);
}

TEST(SolveCalibration, ScaleBarsSetTheScale) {
  const ScaleBar bar{"bar", "tag36h11", 500, 501, 300};
  const SimulatedCalibration truth = Simulate(6, 50, 0.1, 1.5, {bar});
  CalibrationTarget wrong = truth.moved.target;
  for (TagBoard& board : wrong.boards) {
    board.tag_mm *= 1.02;
    board.gap_mm *= 1.02;
  }
  const auto by_tags = SolveCalibration(wrong, truth.views, std::nullopt, {});
  ASSERT_TRUE(by_tags.ok()) << by_tags.status();
  ASSERT_EQ(by_tags->bars.size(), 1u);
  EXPECT_NEAR(by_tags->bars[0].length_mm, 306, 0.1);
  SolveOptions options;
  options.scale_from_bar = true;
  const auto by_bar = SolveCalibration(wrong, truth.views, std::nullopt, options);
  ASSERT_TRUE(by_bar.ok()) << by_bar.status();
  const double between =
      (by_bar->bundle.cameras[0].CenterWorld() - by_bar->bundle.cameras[3].CenterWorld()).norm();
  const double should = (truth.rig.cameras[0].CenterWorld() - truth.rig.cameras[3].CenterWorld()).norm();
  EXPECT_NEAR(between / should, 1, 1.5e-3);
}

TEST(SolveCalibration, TheWorldIsTheBoardThatWasNamed) {
  const SimulatedCalibration truth = Simulate(4, 30, 0.05);
  SolveOptions options;
  options.world_frame = "7";
  options.world_board = "B";
  options.world_on_floor = true;
  const auto solved = SolveCalibration(truth.moved.target, truth.views, std::nullopt, options);
  ASSERT_TRUE(solved.ok()) << solved.status();
  for (const BoardPlacement& p : solved->bundle.placements) {
    if (p.frame != 7 || p.board != 1) continue;
    EXPECT_LT(p.world_from_board.translation_mm.norm(), 1e-6);
    EXPECT_LT((p.world_from_board.rotation.col(2) - Eigen::Vector3d::UnitY()).norm(), 1e-6);
  }
  options.world_frame = "99";
  const auto none = SolveCalibration(truth.moved.target, truth.views, std::nullopt, options);
  EXPECT_EQ(none.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(SolveCalibration, CamerasWithoutSharedBoardsAreNamed) {
  SimulatedCalibration truth = Simulate(6, 60, 0.1);
  std::erase_if(truth.views.boards,
                [](const BoardView& view) { return (view.camera < 3) != (view.frame < 30); });
  const auto solved = SolveCalibration(truth.moved.target, truth.views, std::nullopt, {});
  EXPECT_EQ(solved.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(solved.status().message()), HasSubstr("no board links cameras"));
}

}  // namespace
}  // namespace weft
