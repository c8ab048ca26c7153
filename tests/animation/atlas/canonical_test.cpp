#include "animation/atlas/canonical.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

TEST(CanonicalAxes, AtRestNothingIsTurned) {
  const Template garment = WavingTube::Garment();
  const MeshGraph graph = BuildMeshGraph(garment.rest);
  for (const Eigen::Matrix3f& r : CanonicalAxes(garment.rest, graph).RotationsOf(garment.rest.vertices_mm))
    EXPECT_LT((r - Eigen::Matrix3f::Identity()).norm(), 1e-5f);
}

TEST(CanonicalAxes, FollowRigidMotion) {
  const Template garment = WavingTube::Garment();
  const MeshGraph graph = BuildMeshGraph(garment.rest);
  const Eigen::Isometry3d motion =
      Eigen::Translation3d(100, -20, 3) * Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized());
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& p : garment.rest.vertices_mm) moved.push_back(motion * p);
  for (const Eigen::Matrix3f& r : CanonicalAxes(garment.rest, graph).RotationsOf(moved))
    EXPECT_LT((r - motion.linear().cast<float>()).norm(), 1e-4f);
}

TEST(CanonicalAxes, AreRotationsOnBentClothAndOfFlatPoints) {
  const Template garment = WavingTube::Garment();
  const MeshGraph graph = BuildMeshGraph(garment.rest);
  const CanonicalAxes axes(garment.rest, graph);
  std::vector<Eigen::Vector3d> point(garment.rest.vertices_mm.size(), Eigen::Vector3d(1, 2, 3));
  for (const std::vector<Eigen::Vector3d>& mesh : {WavingTube::At(12, 3), point})
    for (const Eigen::Matrix3f& r : axes.RotationsOf(mesh)) {
      EXPECT_LT((r.transpose() * r - Eigen::Matrix3f::Identity()).norm(), 1e-4f);
      EXPECT_NEAR(r.determinant(), 1, 1e-4);
    }
}

TEST(CanonicalAxes, OfWavingClothStayAsTheyAre) {
  const Template garment = WavingTube::Garment();
  const MeshGraph graph = BuildMeshGraph(garment.rest);
  Recorded recorded;
  recorded.Add("axes", CanonicalAxes(garment.rest, graph).RotationsOf(WavingTube::At(12, 3)));
  recorded.Expect();
}

}  // namespace
}  // namespace weft
