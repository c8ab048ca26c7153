#include "triangulation/camera_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "base/median.h"
#include "tests/triangulation/synthetic_views.h"
#include "triangulation/clean.h"

namespace weft {
namespace {

using testing::BentSheet;
using ::testing::HasSubstr;
using testing::NodeTruth;
using testing::Observe;
using testing::RingRig;

// A closed tube: every camera sees half of it, so that most nodes have few cameras.
std::vector<ViewObservations> ObserveTube(const Rig& rig, double sigma_px, uint32_t seed) {
  std::vector<NodeTruth> nodes;
  constexpr int kRows = 80, kCols = 350;
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kCols; ++c) {
      const double angle = 2 * M_PI * c / kCols;
      nodes.push_back({{r, c, NodeKind::kCenter},
                       {150 * std::sin(angle), (r - 0.5 * kRows) * 2.7, 150 * std::cos(angle)}});
    }
  std::vector<ViewObservations> views = Observe(rig, nodes, sigma_px, seed);
  for (ViewObservations& view : views) {
    const Eigen::Vector3d center = rig.cameras[view.camera].CenterWorld();
    std::erase_if(view.observations, [&](const Observation& o) {
      const double angle = 2 * M_PI * o.node.col / kCols;
      const Eigen::Vector3d normal(std::sin(angle), 0, std::cos(angle));
      return normal.dot((center - 150 * normal).normalized()) < 0.3;
    });
  }
  return views;
}

double MedianCommonPx(const std::vector<CameraAgreement>& agreements) {
  std::vector<double> common_px;
  for (const CameraAgreement& agreement : agreements) common_px.push_back(agreement.common_px);
  return Median(std::move(common_px));
}

// Cameras of `rig` with the places of others: camera c stands where the rig says that places[c] does.
std::vector<ViewObservations> Exchanged(std::vector<ViewObservations> views, const std::vector<int>& places) {
  std::vector<ViewObservations> out(views.size());
  for (size_t c = 0; c < views.size(); ++c) {
    out[c] = std::move(views[places[c]]);
    out[c].camera = static_cast<int>(c);
  }
  return out;
}

std::vector<int> Places(int cameras, const std::vector<int>& ring) {
  std::vector<int> places(cameras);
  for (int c = 0; c < cameras; ++c) places[c] = c;
  for (size_t i = 0; i < ring.size(); ++i) places[ring[i]] = ring[(i + 1) % ring.size()];
  return places;
}

std::vector<CameraAgreement> AgreementsOf(const Rig& rig, const std::vector<ViewObservations>& views) {
  auto cloud = Triangulate(rig, views, {});
  EXPECT_TRUE(cloud.ok()) << cloud.status();
  const auto agreements = MeasureCameraAgreement(rig, views, CleanCloud(*std::move(cloud), {}), {});
  EXPECT_TRUE(agreements.ok()) << agreements.status();
  return *agreements;
}

double Share(const CameraAgreement& agreement) {
  return agreement.compared > 0 ? static_cast<double>(agreement.agreeing) / agreement.compared : -1;
}

// Every other camera saw the cloth a little later, 0.6 mm higher.
TEST(CameraAgreement, WhatOffsetsShareTellsOfTimeAndNotOfNoise) {
  const Rig rig = RingRig(16);
  for (const double sigma_px : {0.1, 0.5}) {
    std::vector<ViewObservations> views = ObserveTube(rig, sigma_px, 3);
    EXPECT_LT(MedianCommonPx(AgreementsOf(rig, views)), 0.1) << sigma_px;
    double offset_px = 0;
    for (ViewObservations& view : views) {
      if (view.camera % 2 == 0) continue;
      const CameraModel& camera = rig.cameras[view.camera];
      const Eigen::Vector2d at = *camera.Project(Eigen::Vector3d(0, 0, 0));
      const Eigen::Vector2d later = *camera.Project(Eigen::Vector3d(0, 0.6, 0));
      offset_px = (later - at).norm();
      for (Observation& o : view.observations)
        o.x_px += static_cast<float>((later - at).x()), o.y_px += static_cast<float>((later - at).y());
    }
    const double common_px = MedianCommonPx(AgreementsOf(rig, views));
    EXPECT_GT(common_px, 0.3 * offset_px) << sigma_px;
    EXPECT_LT(common_px, 0.7 * offset_px) << sigma_px;
  }
}

TEST(CameraAgreement, RightCamerasAgreeAndNoOtherPlaceIsLookedFor) {
  for (const int cameras : {5, 8, 16, 24}) {
    const Rig rig = RingRig(cameras);
    for (const CameraAgreement& agreement : AgreementsOf(rig, ObserveTube(rig, 0.3, cameras))) {
      if (agreement.compared > 0) {
        EXPECT_GT(Share(agreement), 0.99) << cameras;
      }
      EXPECT_FALSE(agreement.fits.has_value());
      EXPECT_LT(agreement.median_px, 1);
      if (agreement.scale > 0) {
        EXPECT_NEAR(agreement.scale, 1, 5e-4);
      }
    }
  }
}

TEST(CameraAgreement, ExchangedCamerasFitEachOthersPlace) {
  const Rig rig = RingRig(16);
  const std::vector<ViewObservations> views = ObserveTube(rig, 0.2, 1);
  for (const auto& [a, b] : std::vector<std::pair<int, int>>{{3, 7}, {0, 1}, {2, 10}, {14, 15}}) {
    const auto agreements = AgreementsOf(rig, Exchanged(views, Places(16, {a, b})));
    for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)}) {
      EXPECT_LT(Share(agreements[one]), 0.5) << one;
      ASSERT_TRUE(agreements[one].fits.has_value()) << one;
      EXPECT_EQ(agreements[one].fits->camera, other);
      EXPECT_EQ(agreements[one].fits->turn, ImageTurn::kNone);
      EXPECT_LT(agreements[one].fits->median_px, 1);
    }
    for (int c = 0; c < 16; ++c) {
      if (c == a || c == b) continue;
      EXPECT_GT(Share(agreements[c]), 0.95) << c;
      EXPECT_FALSE(agreements[c].fits.has_value()) << c;
    }
  }
}

TEST(CameraAgreement, ARingOfThreeIsFollowed) {
  const Rig rig = RingRig(12);
  const auto agreements = AgreementsOf(rig, Exchanged(ObserveTube(rig, 0.2, 1), Places(12, {2, 9, 5})));
  ASSERT_TRUE(agreements[2].fits && agreements[9].fits && agreements[5].fits);
  EXPECT_EQ(agreements[2].fits->camera, 9);
  EXPECT_EQ(agreements[9].fits->camera, 5);
  EXPECT_EQ(agreements[5].fits->camera, 2);
}

// Where half of the cameras are exchanged no point says who is wrong.
TEST(CameraAgreement, AmongFewCamerasTheExchangeIsSearched) {
  for (const int cameras : {3, 4, 5}) {
    const Rig rig = RingRig(cameras);
    std::vector<ViewObservations> views = Observe(rig, BentSheet(40, 40), 0.2, 1);  // seen by all
    const auto agreements = AgreementsOf(rig, Exchanged(std::move(views), Places(cameras, {0, 2})));
    ASSERT_TRUE(agreements[0].fits && agreements[2].fits) << cameras;
    EXPECT_EQ(agreements[0].fits->camera, 2);
    EXPECT_EQ(agreements[2].fits->camera, 0);
    EXPECT_LT(Share(agreements[0]), 0.1);
    EXPECT_FALSE(agreements[1].fits.has_value());
  }
}

// Lenses, principal points and sizes of images differ, as of cropped images.
Rig CroppedRing(int cameras) {
  Rig rig = RingRig(cameras);
  for (int c = 0; c < cameras; ++c) {
    CameraModel& camera = rig.cameras[c];
    camera.fx_px = camera.fy_px = c % 2 == 0 ? 4600 : 6000;
    camera.cx_px -= 37 * c, camera.cy_px -= 21 * c;
    camera.width_px -= 60 * c, camera.height_px -= 40 * c;
  }
  return rig;
}

TEST(CameraAgreement, PlacesAndLensesThatWereExchangedAreToldApart) {
  const Rig filmed = CroppedRing(16);
  const std::vector<ViewObservations> views = ObserveTube(filmed, 0.2, 1);
  for (const CameraPart part : {CameraPart::kPlaceAndLens, CameraPart::kPlace, CameraPart::kLens}) {
    for (const auto& [a, b] : std::vector<std::pair<int, int>>{{3, 8}, {0, 1}, {2, 10}}) {
      if (part == CameraPart::kLens && (a - b) % 2 == 0) continue;  // the same focal lengths
      Rig rig = filmed;
      rig.cameras[a] = WithPart(filmed.cameras[a], filmed.cameras[b], part);
      rig.cameras[b] = WithPart(filmed.cameras[b], filmed.cameras[a], part);
      const auto agreements = AgreementsOf(rig, views);
      for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)}) {
        ASSERT_TRUE(agreements[one].fits.has_value()) << CameraPartName(part) << " " << one;
        EXPECT_EQ(agreements[one].fits->camera, other);
        EXPECT_EQ(agreements[one].fits->part, part);
      }
      for (int c = 0; c < 16; ++c) {
        if (c == a || c == b) continue;
        EXPECT_FALSE(agreements[c].fits.has_value()) << c;
      }
    }
  }
}

TEST(CameraAgreement, AmongFewCamerasPlacesAloneAreSearched) {
  const Rig filmed = CroppedRing(4);
  const std::vector<ViewObservations> views = Observe(filmed, BentSheet(40, 40), 0.2, 1);
  Rig rig = filmed;
  rig.cameras[0] = WithPart(filmed.cameras[0], filmed.cameras[3], CameraPart::kPlace);
  rig.cameras[3] = WithPart(filmed.cameras[3], filmed.cameras[0], CameraPart::kPlace);
  const auto agreements = AgreementsOf(rig, views);
  ASSERT_TRUE(agreements[0].fits && agreements[3].fits);
  EXPECT_EQ(agreements[0].fits->camera, 3);
  EXPECT_EQ(agreements[0].fits->part, CameraPart::kPlace);
  EXPECT_EQ(agreements[3].fits->camera, 0);
}

TEST(CameraAgreement, ACameraElsewhereFitsNoPlace) {
  const Rig filmed = RingRig(10);
  const std::vector<ViewObservations> views = ObserveTube(filmed, 0.2, 1);
  Rig rig = filmed;
  CameraModel& camera = rig.cameras[4];
  camera.rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()) * camera.rotation;
  const auto agreements = AgreementsOf(rig, views);
  EXPECT_LT(Share(agreements[4]), 0.1);
  EXPECT_GT(agreements[4].compared, 100);
  EXPECT_GT(agreements[4].median_px, 100);
  EXPECT_FALSE(agreements[4].fits.has_value());
  EXPECT_GT(Share(agreements[3]), 0.95);
}

// The bias of a camera says by how much it was knocked.
TEST(CameraAgreement, AKnockedCameraStillAgrees) {
  const Rig filmed = RingRig(10);
  const std::vector<ViewObservations> views = ObserveTube(filmed, 0.2, 1);
  Rig rig = filmed;
  CameraModel& camera = rig.cameras[4];
  const Eigen::Vector3d center = camera.CenterWorld();
  camera.rotation = Eigen::AngleAxisd(0.1 * M_PI / 180, Eigen::Vector3d::UnitY()) * camera.rotation;
  camera.translation_mm = -camera.rotation * center;
  const auto agreements = AgreementsOf(rig, views);
  EXPECT_GT(Share(agreements[4]), 0.95);
  EXPECT_NEAR(agreements[4].median_px, camera.fx_px * 0.1 * M_PI / 180, 0.5);
  EXPECT_FALSE(agreements[4].fits.has_value());
}

TEST(CameraAgreement, TurnedImagesAreTold) {
  const Rig rig = RingRig(10);
  const struct {
    bool across, down;
    ImageTurn turn;
  } kCases[] = {{true, true, ImageTurn::kUpsideDown},
                {true, false, ImageTurn::kMirrored},
                {false, true, ImageTurn::kMirroredUpsideDown}};
  for (const auto& [across, down, turn] : kCases) {
    std::vector<ViewObservations> views = ObserveTube(rig, 0.2, 1);
    for (Observation& o : views[6].observations) {
      if (across) o.x_px = rig.cameras[6].width_px - 1 - o.x_px;
      if (down) o.y_px = rig.cameras[6].height_px - 1 - o.y_px;
    }
    const auto agreements = AgreementsOf(rig, views);
    ASSERT_TRUE(agreements[6].fits.has_value());
    EXPECT_EQ(agreements[6].fits->camera, 6);
    EXPECT_EQ(agreements[6].fits->turn, turn);
  }
}

TEST(CameraAgreement, AZoomOfOneCameraIsItsScale) {
  const Rig filmed = RingRig(10);
  const std::vector<ViewObservations> views = ObserveTube(filmed, 0.2, 1);
  Rig rig = filmed;
  rig.cameras[4].fx_px *= 0.95, rig.cameras[4].fy_px *= 0.95;
  const auto agreements = AgreementsOf(rig, views);
  EXPECT_NEAR(agreements[4].scale, 1 / 0.95, 0.002);
  EXPECT_GT(agreements[4].scale - 1, 10 * agreements[4].scale_sigma);
  for (int c = 0; c < 10; ++c) {
    if (c == 4) continue;
    EXPECT_NEAR(agreements[c].scale, 1, 0.002) << c;
  }
}

// Points of focal lengths that are all too short are too large, in depth as well.
TEST(CameraAgreement, WrongFocalLengthsOfAllCamerasShowInThePerspective) {
  const Rig filmed = RingRig(16);
  const std::vector<ViewObservations> views = ObserveTube(filmed, 0.2, 1);
  for (const double factor : {0.95, 1.0, 1.05}) {
    Rig rig = filmed;
    for (CameraModel& camera : rig.cameras) camera.fx_px *= factor, camera.fy_px *= factor;
    double sum = 0;
    for (const CameraAgreement& agreement : AgreementsOf(rig, views)) {
      ASSERT_GT(agreement.perspective_sigma, 0);
      sum += agreement.perspective;
    }
    EXPECT_NEAR(sum / 16, 1 - 1 / factor, 0.015) << factor;
  }
}

// A rig of another scale makes all of the points larger, which no image can tell.
TEST(CameraAgreement, AnotherScaleLeavesNoTraceInThePerspective) {
  const Rig filmed = RingRig(16);
  const std::vector<ViewObservations> views = ObserveTube(filmed, 0.2, 1);
  Rig rig = filmed;
  for (CameraModel& camera : rig.cameras) camera.translation_mm *= 1.05;
  double sum = 0;
  for (const CameraAgreement& agreement : AgreementsOf(rig, views)) {
    sum += agreement.perspective;
    EXPECT_NEAR(agreement.scale, 1, 0.001);
  }
  EXPECT_NEAR(sum / 16, 0, 0.01);
}

TEST(CameraAgreement, ASampleSaysTheSame) {
  const Rig rig = RingRig(16);
  const auto views = Exchanged(ObserveTube(rig, 0.2, 1), Places(16, {3, 7}));
  const auto agreements = MeasureSampledAgreement(rig, views, {});
  ASSERT_TRUE(agreements.ok()) << agreements.status();
  for (int c = 0; c < 16; ++c) {
    EXPECT_GT((*agreements)[c].compared, 50) << c;
    EXPECT_EQ((*agreements)[c].fits.has_value(), c == 3 || c == 7) << c;
  }
}

TEST(CameraAgreement, ErrorsNameTheView) {
  EXPECT_THAT(MeasureCameraAgreement(RingRig(3), {{7, {}}}, {}, {}).status().message(),
              HasSubstr("view of camera 7: the rig has 3 cameras"));
}

}  // namespace
}  // namespace weft
