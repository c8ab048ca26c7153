#include "animation/rays/imagined_views.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "alignment/vertex_normals.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

class ImaginedViewsTest : public testing::Test {
 protected:
  ImaginedViewsTest() {
    views_.cameras = 1;
    views_.elevation_deg = 0;
    views_.lost_share = 0;
    views_.noise_rad = 0;
    for (const Eigen::Vector3d& p : tube_.rest.vertices_mm) box_.extend(p);
  }
  std::vector<VertexRay> Rays() const {
    auto rays = ImagineRays(tube_.rest.vertices_mm, tube_.rest.faces, is_node_, views_);
    EXPECT_TRUE(rays.ok()) << rays.status();
    return rays.value_or(std::vector<VertexRay>());
  }
  double Distance() const { return views_.distance * box_.diagonal().norm(); }

  const Template tube_ = WavingTube::Garment();
  std::vector<bool> is_node_ = std::vector<bool>(tube_.rest.vertices_mm.size(), true);
  ImaginedViews views_;
  Eigen::AlignedBox3d box_;
};

TEST_F(ImaginedViewsTest, RaysLeadFromTheCameraToVerticesThatFaceIt) {
  const std::vector<VertexRay> rays = Rays();
  const std::vector<Eigen::Vector3d> normals = VertexNormals(tube_.rest.vertices_mm, tube_.rest.faces);
  std::set<int> seen;
  int before = -1;
  for (const VertexRay& ray : rays) {
    EXPECT_GT(ray.vertex, before) << "ordered by vertex";
    before = ray.vertex;
    seen.insert(ray.vertex);
    EXPECT_EQ(ray.view, 0);
    EXPECT_EQ(ray.sigma_rad, 1.2e-4);
    EXPECT_NEAR((ray.origin_mm - box_.center()).norm(), Distance(), 1e-6);
    EXPECT_NEAR(ray.origin_mm.y(), box_.center().y(), 1e-6);
    EXPECT_LT(ray.OffsetTo(tube_.rest.vertices_mm[static_cast<size_t>(ray.vertex)]).norm(), 1e-6);
  }
  // The tube is round but for a sixth: what faces the camera is in sight, all of it.
  ASSERT_FALSE(rays.empty());
  for (size_t v = 0; v < normals.size(); ++v) {
    const Eigen::Vector3d to = (tube_.rest.vertices_mm[v] - rays[0].origin_mm).normalized();
    const double facing = -normals[v].dot(to), least = std::cos(80 * M_PI / 180);
    if (facing < least - 1e-9) {
      EXPECT_FALSE(seen.contains(static_cast<int>(v))) << v;
    } else if (facing > least + 0.15) {
      EXPECT_TRUE(seen.contains(static_cast<int>(v))) << v;
    }
  }
}

TEST_F(ImaginedViewsTest, CamerasStandAroundTheAxisAboveAndBelowInTurn) {
  views_.cameras = 4;
  views_.azimuth_deg = 30;
  views_.elevation_deg = 22;
  views_.up = Eigen::Vector3d(0, 2, 0);  // of any length
  std::vector<Eigen::Vector3d> eyes(4, Eigen::Vector3d::Zero());
  for (const VertexRay& ray : Rays()) eyes[static_cast<size_t>(ray.view)] = ray.origin_mm - box_.center();
  const Eigen::Vector3d aside = views_.up.unitOrthogonal();
  for (int camera = 0; camera < 4; ++camera) {
    const Eigen::Vector3d& eye = eyes[static_cast<size_t>(camera)];
    EXPECT_NEAR(eye.norm(), Distance(), 1e-6);
    EXPECT_NEAR(eye.y(), (camera % 2 == 0 ? 1 : -1) * Distance() * std::sin(22 * M_PI / 180), 1e-6);
    const Eigen::Vector3d level(eye.x(), 0, eye.z());
    const Eigen::Vector3d expected =
        Eigen::AngleAxisd((30 + 90 * camera) * M_PI / 180, Eigen::Vector3d::UnitY()) * aside;
    EXPECT_LT((level.normalized() - expected).norm(), 1e-9) << camera;
  }
}

TEST_F(ImaginedViewsTest, OnlyNodesHaveRays) {
  const size_t all = Rays().size();
  const int first = Rays()[0].vertex;
  is_node_[static_cast<size_t>(first)] = false;
  const std::vector<VertexRay> rays = Rays();
  EXPECT_EQ(rays.size(), all - 1);
  EXPECT_NE(rays[0].vertex, first);
}

TEST_F(ImaginedViewsTest, ClothBehindOtherClothIsNotSeen) {
  views_.most_facing_deg = 180;  // its other side would do
  const std::vector<VertexRay> rays = Rays();
  const Eigen::Vector3d toward = (rays[0].origin_mm - box_.center()).normalized();
  for (const VertexRay& ray : rays)
    EXPECT_GT(toward.dot(tube_.rest.vertices_mm[static_cast<size_t>(ray.vertex)] - box_.center()), -60);
}

TEST_F(ImaginedViewsTest, SomeAreLostAndAllAreNoisy) {
  views_.cameras = 3;
  const size_t all = Rays().size();
  views_.lost_share = 0.3;
  const size_t kept = Rays().size();
  EXPECT_NEAR(static_cast<double>(kept) / static_cast<double>(all), 0.7, 0.07);
  views_.lost_share = 0;
  views_.noise_rad = 1e-3;
  double squares = 0;
  for (const VertexRay& ray : Rays()) {
    const Eigen::Vector3d to = tube_.rest.vertices_mm[static_cast<size_t>(ray.vertex)] - ray.origin_mm;
    squares +=
        std::pow(ray.OffsetTo(tube_.rest.vertices_mm[static_cast<size_t>(ray.vertex)]).norm() / to.norm(), 2);
    EXPECT_NEAR(ray.direction.norm(), 1, 1e-12);
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(all)), 1e-3 * std::sqrt(2), 1.5e-4);
  const Eigen::Vector3d before = Rays()[0].direction;
  EXPECT_EQ(Rays()[0].direction, before);
  views_.seed = 2;
  EXPECT_NE(Rays()[0].direction, before);
}

TEST_F(ImaginedViewsTest, RaysStayAsTheyAre) {
  views_ = ImaginedViews();
  views_.cameras = 3;
  views_.azimuth_deg = 50;
  const std::vector<VertexRay> rays = Rays();
  std::vector<int> vertices, views;
  std::vector<Eigen::Vector3d> directions;
  for (const VertexRay& ray : rays)
    vertices.push_back(ray.vertex), views.push_back(ray.view), directions.push_back(ray.direction);
  Recorded recorded;
  recorded.Add("vertices", vertices);
  recorded.Add("views", views);
  recorded.Add("directions", directions);
  recorded.Expect();
}

}  // namespace
}  // namespace weft
