#include "simulation/synthetic_take.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/simulation/tiny_take.h"

namespace weft {
namespace {

TEST(SyntheticTake, TruthIsThatOfTheMiddleOfEachCamerasExposure) {
  SyntheticTakeOptions options = TinyOptions(1, 1, 4);
  options.performance.handles.sway_mm = 20;
  options.shutter.time_offset_ms = 4, options.shutter.exposure_ms = 2;
  auto take = SyntheticTake::Make(options);
  ASSERT_TRUE(take.ok()) << take.status();
  const auto frame = take->Next();
  ASSERT_TRUE(frame.ok()) << frame.status();
  auto performance = Performance::Start(options.performance);
  ASSERT_TRUE(performance.ok());
  const auto moment = performance->Next();
  ASSERT_TRUE(moment.ok());
  int checked = 0;
  for (int c = 0; c < 4; ++c) {
    const auto view = take->Film(*frame, c);
    ASSERT_TRUE(view.ok()) << view.status();
    EXPECT_NE(view->mid_exposure_ns, 0);
    EXPECT_LE(std::abs(view->mid_exposure_ns), 4000000);
    for (const NodeTruth& n : view->truth.nodes) {
      if (n.vertex < 0) continue;
      const Eigen::Vector3d place =
          moment->vertices_mm[n.vertex] + 1e-9 * view->mid_exposure_ns * moment->velocities_mm_s[n.vertex];
      const auto pixel = take->rig().cameras[c].Project(place);
      ASSERT_TRUE(pixel.has_value());
      EXPECT_LT((*pixel - n.pixel_px).norm(), 1e-6);
      ++checked;
    }
  }
  EXPECT_GT(checked, 500);
}

TEST(SyntheticTake, GarmentHangsWhereAGivenRigLooksAndPicturesAreCroppedToIt) {
  SyntheticTakeOptions options = TinyOptions(1, 1, 3);
  options.rig.aim_mm = {500, -300, 900};
  options.rig.fill = 0.4;
  const auto rig = MakeStudioRig("given", options.rig);
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_LT((AimOf(*rig) - options.rig.aim_mm).norm(), 40) << "cameras look past the aim a little";
  options.given_rig = *rig;
  options.crop_margin_mm = 5;
  auto take = SyntheticTake::Make(options);
  ASSERT_TRUE(take.ok()) << take.status();
  const auto frame = take->Next();
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_LT((frame->scene.CenterMm() - AimOf(*rig)).norm(), 15);
  for (size_t c = 0; c < take->rig().cameras.size(); ++c) {
    const CameraModel &cropped = take->rig().cameras[c], &whole = rig->cameras[rig->IndexOf(cropped.id)];
    EXPECT_LT(cropped.width_px * cropped.height_px, whole.width_px * whole.height_px);
    const auto a = cropped.Project(frame->scene.CenterMm()), b = whole.Project(frame->scene.CenterMm());
    ASSERT_TRUE(a && b);
    EXPECT_NEAR((*b - *a).x(), whole.cx_px - cropped.cx_px, 1e-9);
    for (const Eigen::Vector3d& v : frame->scene.mesh().vertices_mm) {
      const auto pixel = whole.Project(v);
      if (!pixel || !whole.Contains(*pixel)) continue;
      EXPECT_TRUE(cropped.Contains(*cropped.Project(v)));
    }
  }
}

TEST(SyntheticTake, AFrameThatIsPassedOverMovesTheClothAllTheSame) {
  SyntheticTake skipping = Tiny(1, 2, 1), looking = Tiny(1, 2, 1);
  ASSERT_TRUE(skipping.Skip().ok());
  ASSERT_TRUE(looking.NextCloth().ok());
  EXPECT_EQ(skipping.next(), 1);
  const auto a = skipping.NextCloth(), b = looking.NextCloth();
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->vertices_mm, b->vertices_mm);
  EXPECT_EQ(skipping.NextCloth().status().code(), absl::StatusCode::kOutOfRange);
}

TEST(SyntheticTake, ShuttersOutOfRangeAreRefused) {
  EXPECT_TRUE(ShutterOptions().Validate().ok());
  for (const double wrong : {-0.1, std::nan("")}) {
    EXPECT_EQ(ShutterOptions{.exposure_ms = wrong}.Validate().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(ShutterOptions{.time_offset_ms = wrong}.Validate().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(ShutterOptions{.drop_rate = wrong}.Validate().code(), absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace weft
