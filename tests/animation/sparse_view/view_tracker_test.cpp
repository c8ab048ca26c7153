#include "animation/sparse_view/view_tracker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "animation/sparse_view/sparse_view_driver.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

constexpr int kTrackedSeed = 17;  // of motions that no avatar has learnt

const SparseViewAvatar& TrackedAvatar() {
  static const SparseViewAvatar avatar =
      *LearnSparseView(WavingTube::Garment(), WavingTube::Frames(), {.components = 5});
  return avatar;
}

// Of more rays than it takes, it takes evenly spread ones.
TEST(ViewTracker, TracksStayAsTheyAre) {
  const AlignmentModel model(WavingTube::Garment());
  const SparseViewAvatar& avatar = TrackedAvatar();
  TrackerOptions options;
  options.max_rays = 100, options.min_rays = 100;
  options.local.regions = 4;
  ViewTracker tracker(model, avatar.space, avatar.left_mm, avatar.acceleration, options);
  const std::vector<CameraModel> cameras = CamerasAround(2);
  const NodeVertices nodes(WavingTube::Garment());
  const auto rays_at = [&](int frame) {
    const auto a = WavingTube::Seen(cameras[0], WavingTube::At(frame, kTrackedSeed), 1),
               b = WavingTube::Seen(cameras[1], WavingTube::At(frame, kTrackedSeed), 2);
    const std::vector<DrivingView> views = {{&cameras[0], a}, {&cameras[1], b}};
    return *RaysOf(views, nodes, 0.1);
  };
  Recorded recorded;
  // One after the other, then after a gap, and after one that is too long.
  for (const auto& [frame, gap] : {std::pair(0, 1.0), {1, 1.0}, {2, 1.0}, {7, 5.0}, {37, 30.0}, {68, 31.0}}) {
    const GarmentTrack track = tracker.Follow(gap, rays_at(frame));
    ASSERT_FALSE(track.lost) << track.reason;
    EXPECT_EQ(track.started_anew, frame == 0 || frame == 68) << frame;
    EXPECT_EQ(tracker.memory().known, frame == 0 || frame == 68 ? 1 : 2) << frame;
    recorded.Add("root", track.state.root.matrix());
    recorded.Add("z", track.state.z);
    recorded.Add("local", track.state.local);
    recorded.Add("agreeing", track.agreeing_share);
  }
  recorded.Expect();
  std::vector<VertexRay> few = rays_at(69);
  few.resize(99);
  const GarmentTrack lost = tracker.Follow(1, few);
  EXPECT_TRUE(lost.lost);
  EXPECT_EQ(lost.reason, "99 cells of the garment were seen, at least 100 are needed");
  EXPECT_GT(lost.state.root.matrix().norm(), 0);
  EXPECT_EQ(tracker.memory().known, 0);
  TrackMemory other;
  other.known = 3;
  EXPECT_EQ(tracker.Restore(other).message(),
            "tracking: what is to be recalled is of a number of frames that is not 0 to 2");
  other.known = -1;
  EXPECT_FALSE(tracker.Restore(other).ok());
  other.known = 0;
  EXPECT_TRUE(tracker.Restore(other).ok());
}

TEST(SparseViewDriver, SaysInWordsWhyAFrameIsLost) {
  SparseViewDriver driver = *SparseViewDriver::Create(WavingTube::Garment(), TrackedAvatar());
  const std::vector<CameraModel> cameras = CamerasAround(1);
  auto seen = WavingTube::Seen(cameras[0], WavingTube::At(0, kTrackedSeed), 1);
  // Two thirds of them somewhere else.
  for (size_t k = 0; k < seen.size(); ++k)
    if (k % 3 > 0) seen[k].x_px = 960 * UniformOf(3, 2 * k), seen[k].y_px = 1280 * UniformOf(3, 2 * k + 1);
  const std::vector<DrivingView> views = {{&cameras[0], seen}};
  const auto driven = driver.Drive(0, views);
  ASSERT_TRUE(driven.ok()) << driven.status();
  EXPECT_THAT(driven->reason,
              testing::MatchesRegex("only [1-4]?[0-9] % of the cells seen agree with a shape of "
                                    "the garment, at least 50 % are needed"));
  EXPECT_EQ(driven->rejected_rays, driven->rays);
  for (const int views_of : driven->mesh.views) EXPECT_EQ(views_of, 0);
  EXPECT_EQ(driver.Memory().drive.track.known, 0);
  EXPECT_TRUE(driver.Memory().drive.mesh_mm.empty());
  driver.Reset();
  EXPECT_FALSE(driver.Memory().last_ns.has_value());
}

}  // namespace
}  // namespace weft
