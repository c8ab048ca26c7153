// From films of a board that sways to the clocks of their cameras.
#include "services/studio/video/motion_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "base/mutex.h"
#include "services/studio/video/camera_offsets.h"
#include "services/studio/video/video_facts.h"
#include "tests/services/studio/video/made_video.h"
#include "tests/services/tools/cli/board_picture.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kWidth_px = 320, kHeight_px = 240, kFps = 20, kFilmFrames = 24;
constexpr size_t kPictureBytes = size_t{3} * kWidth_px * kHeight_px;
constexpr double kCell_mm = 8;

// Two cameras before a board that swings and turns; the second one's clock is late.
class MotionOffsetsTest : public ::testing::Test {
 protected:
  MotionOffsetsTest() : board_(*GenerateBoard(20, 24, kCell_mm, 5)), print_(PictureOfBoard(board_, 8, 8)) {
    for (const double turn : {0.0, 0.6}) {
      CameraModel camera;
      camera.id = turn == 0 ? "left" : "right";
      camera.width_px = kWidth_px, camera.height_px = kHeight_px;
      camera.fx_px = camera.fy_px = 600;
      camera.cx_px = (kWidth_px - 1) / 2.0, camera.cy_px = (kHeight_px - 1) / 2.0;
      camera.rotation = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()).toRotationMatrix();
      camera.translation_mm = {0, 0, 600};
      rig_.cameras.push_back(camera);
    }
  }

  // What the camera sees of the board `at_s`; grey where there is none.
  void AppendPicture(const CameraModel& camera, double at_s, std::string& raw) const {
    const double t = speed_ * at_s;
    const Eigen::Matrix3d turned = (Eigen::AngleAxisd(0.25 * std::sin(5.3 * t), Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(0.2 * std::sin(4.1 * t + 1), Eigen::Vector3d::UnitZ()))
                                       .toRotationMatrix();
    const Eigen::Vector3d middle(25 * std::sin(6 * t), 18 * std::sin(7.7 * t + 2), 30 * std::sin(3.1 * t));
    const Eigen::Vector3d center = camera.CenterWorld();
    for (int y = 0; y < kHeight_px; ++y)
      for (int x = 0; x < kWidth_px; ++x) {
        const Eigen::Vector3d ray =
            turned.transpose() * camera.rotation.transpose() *
            Eigen::Vector3d((x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1);
        const Eigen::Vector3d from = turned.transpose() * (center - middle);
        const Eigen::Vector3d on = from - ray * (from.z() / ray.z());  // mm from the board's middle
        AppendColour(on.x() + (print_.width_px - 1) / 2.0, on.y() + (print_.height_px - 1) / 2.0, raw);
      }
  }
  // Of the print, at a pixel's fraction.
  void AppendColour(double x, double y, std::string& raw) const {
    const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
    const bool is_outside = left < 0 || top < 0 || left + 1 >= print_.width_px || top + 1 >= print_.height_px;
    for (int c = 0; c < 3; ++c) {
      const auto at = [&](int dx, int dy) { return print_.row(top + dy)[3 * (left + dx) + c]; };
      const double u = x - left, v = y - top;
      const double value = is_outside ? 90
                                      : (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) +
                                            v * ((1 - u) * at(0, 1) + u * at(1, 1));
      raw.push_back(static_cast<char>(std::lround(value)));
    }
  }
  // The camera's film, whose first picture is of this moment.
  v1::VideoFacts Film(const std::string& camera, double begin_s, bool sees_board = true) const {
    const std::string file = temp_ / (camera + ".mkv");
    const int index = rig_.IndexOf(camera);
    std::string raw;
    for (int i = 0; i < kFilmFrames; ++i) {
      if (!sees_board)
        raw.append(kPictureBytes, 90);
      else if (speed_ == 0 && i > 0)
        raw.append(raw, 0, kPictureBytes);
      else
        AppendPicture(rig_.cameras[static_cast<size_t>(index)], begin_s + static_cast<double>(i) / kFps, raw);
    }
    WriteBytes(file + ".raw", raw);
    Shell("ffmpeg -v error -y -f rawvideo -pixel_format rgb24 -video_size 320x240 -framerate 20 -i '" + file +
          ".raw' -c:v ffv1 -pix_fmt bgr0 '" + file + "'");
    auto facts = InspectVideo(std::filesystem::canonical(file).string());
    EXPECT_TRUE(facts.ok()) << facts.status();
    facts->set_camera(camera);
    return *std::move(facts);
  }
  absl::StatusOr<std::vector<v1::CameraSync>> Search(const std::vector<v1::VideoFacts>& videos,
                                                     uint64_t most = UINT64_MAX) {
    told_.clear();
    return OffsetsByMotion(rig_, board_, videos, {.max_offset_s = 0.25, .window_s = window_s_, .mosaic = {}},
                           [&](uint64_t done, uint64_t total) {
                             const MutexLock lock(mutex_);
                             told_.emplace_back(done, total);
                             return done < most;
                           });
  }

  const TempFolder temp_;
  const Board board_;
  const Frame print_;
  Rig rig_;
  double speed_ = 1, window_s_ = 0.7;
  Mutex mutex_;
  std::vector<std::pair<uint64_t, uint64_t>> told_;
};

TEST_F(MotionOffsetsTest, AClockThatIsLateIsFoundToAFractionOfAFrame) {
  const std::vector<v1::VideoFacts> videos = {Film("left", 0), Film("right", 0.13)};
  const auto syncs = Search(videos);
  ASSERT_TRUE(syncs.ok()) << syncs.status();
  ASSERT_EQ(syncs->size(), 2u);
  EXPECT_NEAR((*syncs)[1].offset_s() - (*syncs)[0].offset_s(), 0.13, 0.002);
  for (const v1::CameraSync& sync : *syncs) {
    EXPECT_EQ(sync.found_by(), "motion");
    EXPECT_GT(sync.offset_sigma_s(), 0);
    EXPECT_LT(sync.offset_sigma_s(), 0.0025);  // else another window would be looked at
  }
  // 0.7 s in the middle of 1.15 s: frames 5 to 18 of both.
  ASSERT_EQ(told_.size(), 28u);
  std::ranges::sort(told_);
  for (size_t i = 0; i < told_.size(); ++i) EXPECT_EQ(told_[i], std::pair(uint64_t{i + 1}, uint64_t{28}));
  const auto stopped = Search(videos, 3);
  EXPECT_TRUE(absl::IsCancelled(stopped.status())) << stopped.status();
}

TEST_F(MotionOffsetsTest, ABoardThatStandsStillTellsNothingInAnyWindow) {
  speed_ = 0;
  window_s_ = 0.3;
  const auto still = Search({Film("left", 0), Film("right", 0.13)});
  EXPECT_TRUE(absl::IsFailedPrecondition(still.status())) << still.status();
  EXPECT_THAT(std::string(still.status().message()),
              AllOf(HasSubstr("motion does not tell the offsets of the videos: "),
                    HasSubstr("; film a moment in which all cameras see the print move, or give offsets "
                              "(--offset CAMERA=SECONDS)")));
  // Six frames of each film in the middle, and a quarter of the time to each side of it.
  EXPECT_EQ(told_.size(), 3 * 12u);
}

TEST_F(MotionOffsetsTest, ACameraThatSeesNothingOfItIsNamed) {
  rig_.cameras.push_back(rig_.cameras[0]);
  rig_.cameras[2].id = "back";
  const auto found = Search({Film("left", 0), Film("back", 0, false), Film("right", 0.13)});
  EXPECT_TRUE(absl::IsFailedPrecondition(found.status())) << found.status();
  EXPECT_THAT(
      std::string(found.status().message()),
      HasSubstr("motion does not tie back to the other cameras: too few cells of the print are seen in "
                "common, or the clips are further apart; film a moment"));
}

}  // namespace
}  // namespace weft
