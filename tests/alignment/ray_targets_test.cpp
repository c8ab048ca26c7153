#include "alignment/ray_targets.h"

#include <gtest/gtest.h>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;
using testing::Mapped;
using testing::MeanError;
using testing::Measure;
using testing::SheetTemplate;

constexpr int kRidgeRows = 40, kRidgeCols = 50;

// The ridge, all along it.
bool OnRidge(int v) { return std::abs(v % kRidgeCols - kRidgeCols / 2) <= 8; }

// The plane z = 0 with a ridge across its middle, which keeps all lengths along the surface.
Eigen::Vector3d WithRidge(const Eigen::Vector3d& p) {
  constexpr double kStepMm = 0.05, kWidthMm = 7, kSteepness = 1.3;
  Eigen::Vector3d at(0, p.y(), 0);
  for (double s = 0; s < p.x(); s += kStepMm) {
    const double from_middle = (s - kRidgeCols * testing::kCellMm / 2) / kWidthMm;
    const double slope = -kSteepness * from_middle * std::exp(-from_middle * from_middle / 2);
    at += kStepMm * Eigen::Vector3d(std::cos(slope), 0, std::sin(slope));
  }
  return at;
}

// Of the sheet's middle one camera sees every other cell.
class RayTargets : public ::testing::Test {
 protected:
  RayTargets() {
    truth_mm_ = Mapped(garment_.rest.vertices_mm, WithRidge);
    targets_ = Measure(truth_mm_, 0.05, 1, [](int v) { return !OnRidge(v); });
    for (VertexTarget& t : targets_) t.sigma_mm = 0.1, t.views = 4;
    for (int v = 0; v < kRidgeRows * kRidgeCols; v += 2)
      if (OnRidge(v)) rays_.push_back(RayThrough(v, truth_mm_[v]));
  }

  static RayTarget RayThrough(int vertex, const Eigen::Vector3d& point_mm) {
    const Eigen::Vector3d camera_mm(700, -900, 1000);
    return {vertex, camera_mm, (point_mm - camera_mm).normalized(), 1e-4};
  }

  AlignResult Aligned(const std::vector<RayTarget>& rays, const AlignOptions& options = {}) const {
    absl::StatusOr<AlignResult> result = Align(garment_, targets_, options, {.rays = &rays});
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? *std::move(result) : AlignResult();
  }
  double HiddenError(const AlignResult& result) const {
    return MeanError(result.mesh.vertices_mm, truth_mm_, OnRidge);
  }

  const Template garment_ = SheetTemplate(FlatSheet(kRidgeRows, kRidgeCols));
  std::vector<Eigen::Vector3d> truth_mm_;
  std::vector<VertexTarget> targets_;
  std::vector<RayTarget> rays_;
};

TEST_F(RayTargets, WhatOneCameraSawOfAFoldIsFollowed) {
  const AlignResult without = Aligned({}), with = Aligned(rays_);
  EXPECT_EQ(without.rays, 0);
  EXPECT_EQ(with.rays, static_cast<int>(rays_.size()));
  EXPECT_GT(HiddenError(without), 2);
  EXPECT_LT(HiddenError(with), 0.4 * HiddenError(without));
  for (const RayTarget& ray : rays_) {
    EXPECT_LT(ray.WayMm(with.mesh.vertices_mm[ray.vertex]).norm(), 0.8);
    EXPECT_EQ(with.mesh.state[ray.vertex], VertexState::kInferred);
  }
  AlignOptions off;
  off.ray_reach_mm = 0;
  EXPECT_EQ(Aligned(rays_, off).mesh.vertices_mm, without.mesh.vertices_mm);
}

TEST_F(RayTargets, VerticesWithAPointKeepToIt) {
  std::vector<RayTarget> wrong;
  for (const VertexTarget& t : targets_)
    wrong.push_back(RayThrough(t.vertex, t.position_mm + Eigen::Vector3d(5, 0, 0)));
  const AlignResult result = Aligned(wrong);
  EXPECT_EQ(result.rays, 0);
  EXPECT_EQ(result.mesh.vertices_mm, Aligned({}).mesh.vertices_mm);
}

TEST_F(RayTargets, WrongRaysAreSetAside) {
  const double error_mm = HiddenError(Aligned(rays_));
  std::vector<RayTarget> some_wrong = rays_;
  int wrong = 0;
  for (size_t i = 5; i < some_wrong.size(); i += 12, ++wrong) {
    const int vertex = some_wrong[i].vertex;
    some_wrong[i] = RayThrough(vertex, truth_mm_[vertex] + Eigen::Vector3d(i % 2 == 0 ? 9 : -60, 0, 0));
  }
  const AlignResult result = Aligned(some_wrong);
  EXPECT_GE(wrong, 8);
  EXPECT_LE(result.rays, static_cast<int>(rays_.size()) - wrong);
  EXPECT_GE(result.rays, static_cast<int>(rays_.size()) - 2 * wrong);
  EXPECT_LT(HiddenError(result), 1.3 * error_mm);
}

TEST_F(RayTargets, NamesTheRayThatIsNoRay) {
  const auto error = [this](RayTarget wrong) {
    const std::vector<RayTarget> rays = {rays_[0], wrong};
    return std::string(Align(garment_, targets_, {}, {.rays = &rays}).status().message());
  };
  RayTarget ray = rays_[0];
  ray.vertex = kRidgeRows * kRidgeCols;
  EXPECT_EQ(error(ray), "ray 1 (vertex 2000): the template has 2000 vertices, numbered from 0");
  ray = rays_[0];
  ray.direction *= 2;
  EXPECT_NE(error(ray).find("direction must have length 1"), std::string::npos);
  ray = rays_[0];
  ray.origin_mm.y() = std::nan("");
  EXPECT_NE(error(ray).find("origin_mm is not finite"), std::string::npos);
  ray = rays_[0];
  ray.sigma_rad = -1;
  EXPECT_NE(error(ray).find("sigma_rad"), std::string::npos);
}

TEST_F(RayTargets, SeveralRaysOfAVertexFixIt) {
  std::vector<RayTarget> rays;
  const int vertex = kRidgeRows / 2 * kRidgeCols + kRidgeCols / 2;
  for (const double x : {-300.0, 300.0}) {
    const Eigen::Vector3d camera_mm(x, 100, 1200);
    rays.push_back({vertex, camera_mm, (truth_mm_[vertex] - camera_mm).normalized(), 2e-5});
  }
  const AlignResult with = Aligned(rays);
  EXPECT_EQ(with.rays, 2);
  EXPECT_LT((with.mesh.vertices_mm[vertex] - truth_mm_[vertex]).norm(), 1.5);
  EXPECT_GT((Aligned({}).mesh.vertices_mm[vertex] - truth_mm_[vertex]).norm(), 5);
}

}  // namespace
}  // namespace weft
