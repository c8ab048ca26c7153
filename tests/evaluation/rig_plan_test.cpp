#include "evaluation/rig_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "simulation/cloth.h"
#include "simulation/studio_rig.h"
#include "tests/simulation/flat_studio.h"

namespace weft {
namespace {

Template GarmentOf(const Cloth& cloth) {
  Template garment;
  garment.rest = cloth.rest;
  garment.node_of_vertex = cloth.cell_of_vertex;
  return garment;
}

CameraModel Camera(const std::string& id, double angle_deg, double focal_px = 1000) {
  CameraModel camera = FlatCamera(focal_px, 600, angle_deg);
  camera.id = id;
  return camera;
}

class RigPlanTest : public testing::Test {
 protected:
  Template garment_ = GarmentOf(FlatSheet(20, 24));
  std::vector<std::vector<Eigen::Vector3d>> moments_ = {garment_.rest.vertices_mm};
};

TEST_F(RigPlanTest, PitchViewsAndSigmaOfAFlatSheetAreThoseOfGeometry) {
  Rig rig;
  for (const double angle : {-30.0, 0.0, 30.0})
    rig.cameras.push_back(Camera("c" + std::to_string(angle), angle));
  const auto forecast = ForecastRig(garment_, moments_, rig, {.noise_px = 0.2});
  ASSERT_TRUE(forecast.ok()) << forecast.status();
  int center = -1;
  for (size_t v = 0; v < garment_.node_of_vertex.size(); ++v)
    if (garment_.node_of_vertex[v].row == 10 && garment_.node_of_vertex[v].col == 12)
      center = static_cast<int>(v);
  EXPECT_EQ(forecast->views[center], 3);
  EXPECT_EQ(forecast->coverage[center], 1);
  const double px_per_mm = 1000.0 / 600, cosine = std::cos(M_PI / 6);
  EXPECT_NEAR(forecast->pitch_px[center], kFlatCellMm * px_per_mm * (1 + 2 * std::sqrt(cosine)) / 3, 0.05);
  // Across: y is seen by all three; x and z by the pixels' x alone.
  const double pixel = px_per_mm * px_per_mm / (0.2 * 0.2);
  const double xx = pixel * (1 + 2 * cosine * cosine), yy = pixel * 3, zz = pixel * 2 * (1 - cosine * cosine);
  EXPECT_NEAR(forecast->sigma_mm[center], std::sqrt((1 / xx + 1 / yy + 1 / zz) / 3),
              0.01 * forecast->sigma_mm[center]);
  EXPECT_TRUE(std::isnan(forecast->views[garment_.node_of_vertex.size() - 1]));  // hem, without a cell
}

TEST_F(RigPlanTest, CamerasThatSeeNothingAreNotChosen) {
  Rig rig;
  rig.cameras = {Camera("behind", 180), Camera("a", -25), Camera("b", 0),
                 Camera("steep", 80),   Camera("c", 25),  Camera("coarse", 10, 300)};
  const auto plan = PlanRig(garment_, moments_, rig, {});
  ASSERT_TRUE(plan.ok()) << plan.status();
  std::set<std::string> chosen;
  for (const PlanStep& step : *plan) chosen.insert(rig.cameras[step.camera].id);
  EXPECT_EQ(chosen, (std::set<std::string>{"a", "b", "c"}));
  EXPECT_EQ(plan->at(1).coverage, 0);
  EXPECT_EQ(plan->at(2).coverage, 1);
  EXPECT_EQ(plan->at(2).mean_views, 3);
  EXPECT_TRUE(std::isnan(plan->at(1).median_sigma_mm));
}

TEST_F(RigPlanTest, OfCamerasThatSeeTheSameWideAnglesComeFirst) {
  Rig rig;
  for (const double angle : {0.0, 1.0, 2.0, 3.0, -30.0, 30.0})
    rig.cameras.push_back(Camera("c" + std::to_string(rig.cameras.size()), angle));
  const auto plan = PlanRig(garment_, moments_, rig, {.max_cameras = 3});
  ASSERT_TRUE(plan.ok()) << plan.status();
  ASSERT_EQ(plan->size(), 3u);
  std::set<int> chosen;
  for (const PlanStep& step : *plan) chosen.insert(step.camera);
  EXPECT_TRUE(chosen.contains(4) && chosen.contains(5));
}

TEST(RigPlan, TubeIsCoveredBetterWithEveryCameraAndHiddenByItself) {
  ClothOptions options;
  options.rows = 20, options.cols = 40, options.cell_mm = 5;
  const absl::StatusOr<Cloth> cloth = BuildCloth(options);
  ASSERT_TRUE(cloth.ok());
  const Template garment = GarmentOf(*cloth);
  const Rig rig = *MakeStudioRig("ring", {.cameras = 16});
  const auto plan = PlanRig(garment, {garment.rest.vertices_mm}, rig, {});
  ASSERT_TRUE(plan.ok()) << plan.status();
  for (size_t i = 1; i < plan->size(); ++i) {
    EXPECT_GE((*plan)[i].coverage, (*plan)[i - 1].coverage);
    EXPECT_GE((*plan)[i].mean_views, (*plan)[i - 1].mean_views);
  }
  EXPECT_GT(plan->back().coverage, 0.9);
  EXPECT_LT(plan->back().mean_views, 0.45 * 16);  // less than half of a tube faces a camera
  const auto again = PlanRig(garment, {garment.rest.vertices_mm}, rig, {});
  for (size_t i = 0; i < plan->size(); ++i) EXPECT_EQ((*plan)[i].camera, (*again)[i].camera);
}

TEST_F(RigPlanTest, WhatDoesNotFitIsRefused) {
  Rig rig;
  rig.cameras = {Camera("behind", 180)};
  EXPECT_EQ(PlanRig(garment_, moments_, rig, {}).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(PlanRig(garment_, {}, rig, {}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(PlanRig(garment_, {{}}, rig, {}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(PlanRig(garment_, moments_, rig, {.views_needed = 1}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
