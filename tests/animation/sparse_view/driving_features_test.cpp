#include "animation/sparse_view/driving_features.h"

#include <gtest/gtest.h>

#include <cmath>

#include "alignment/vertex_normals.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

// A tube that is 2 % longer than it learnt, on a carrier that is 1 % shorter, seen along made rays.
class DrivingFeaturesTest : public testing::Test {
 protected:
  DrivingFeaturesTest() {
    frame_.position_mm = WavingTube::At(20, 2);
    for (const Eigen::Vector3d& p : frame_.position_mm) frame_.carrier_mm.push_back(p * (0.99 / 1.02));
    for (const auto& [a, b] : model_.graph().edges)
      avatar_.edge_mm.push_back(
          static_cast<float>((frame_.position_mm[a] - frame_.position_mm[b]).norm() / 1.02));
    avatar_.left_mm.assign(frame_.position_mm.size(), 3);
    frame_.misfit.assign(frame_.position_mm.size(), 1.5);
    frame_.track.state.root =
        Eigen::Translation3d(10, -20, 30) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 2) / 3);
    axes_.assign(frame_.position_mm.size(),
                 Eigen::AngleAxisf(0.4f, Eigen::Vector3f(2, -1, 2) / 3).toRotationMatrix());
  }
  void Ray(int vertex, const Eigen::Vector3d& direction, bool rejected = false) {
    rays_.push_back({vertex, 0, Eigen::Vector3d::Zero(), direction.normalized(), 1e-4});
    frame_.rejected.push_back(rejected);
  }
  // Those of a vertex.
  std::vector<float> Of(int vertex) const {
    const DrivingFeatures features(model_, avatar_);
    const std::vector<float> all = features.Of(frame_, rays_, axes_);
    EXPECT_EQ(all.size(), frame_.position_mm.size() * kDrivingFeatures);
    const auto begin = all.begin() + vertex * kDrivingFeatures;
    return {begin, begin + kDrivingFeatures};
  }
  static void ExpectVector(const std::vector<float>& features, size_t at, const Eigen::Vector3d& expected) {
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(features[at + static_cast<size_t>(k)], expected[k], 1e-4) << at << " " << k;
  }

  AlignmentModel model_{WavingTube::Garment()};
  SparseViewAvatar avatar_;
  RayDrivenFrame frame_;
  std::vector<VertexRay> rays_;
  std::vector<Eigen::Matrix3f> axes_;
};

TEST_F(DrivingFeaturesTest, PlacesAreInTheAxesThatTheyPromise) {
  const int vertex = 5 * WavingTube::kColumns + 7;
  const std::vector<float> of = Of(vertex);
  EXPECT_EQ(of[0], 1);
  const Eigen::Vector3d place = frame_.position_mm[vertex];
  ExpectVector(of, 1, axes_[0].transpose().cast<double>() * place * (1 - 0.99 / 1.02) / 20);
  const Eigen::Isometry3d to_space = frame_.track.state.root.inverse();
  ExpectVector(of, 17, to_space * place / 500);
  // The tube at rest stands around the origin.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : model_.rest().vertices_mm)
    middle += p / static_cast<double>(model_.rest().vertices_mm.size());
  ExpectVector(of, 20, (model_.rest().vertices_mm[vertex] - middle) / 500);
  const std::vector<Eigen::Vector3d> normals = VertexNormals(frame_.position_mm, model_.rest().faces);
  ExpectVector(of, 14, to_space.linear() * normals[vertex]);
}

TEST_F(DrivingFeaturesTest, StretchIsThatOfTheEdgesAround) {
  for (const int vertex : {0, 5 * WavingTube::kColumns + 7}) {
    const std::vector<float> of = Of(vertex);
    EXPECT_NEAR(of[23], 0.02 * 20, 1e-4);
    EXPECT_NEAR(of[24], -0.01 * 20, 1e-4);
  }
  // One edge of a vertex that was learnt twice as long: half its length is missing.
  const auto [a, b] = model_.graph().edges.front();
  avatar_.edge_mm.front() *= 2 * 1.02f;
  const double edges = model_.graph().degree(a);
  EXPECT_NEAR(Of(a)[23], 20 * (0.02 * (edges - 1) - 0.5) / edges, 1e-3);
  EXPECT_NEAR(Of(b)[23], 20 * (0.02 * (model_.graph().degree(b) - 1) - 0.5) / model_.graph().degree(b), 1e-3);
}

// An edge counts as twice its length at most.
TEST_F(DrivingFeaturesTest, StretchOfAnEdgeIsBounded) {
  const auto [a, b] = model_.graph().edges.front();
  for (float& length : avatar_.edge_mm) length *= 1.02f;  // none is stretched
  avatar_.edge_mm.front() /= 100;
  const double edges = model_.graph().degree(a);
  EXPECT_NEAR(Of(a)[23], std::min(5.0, 20 / edges), 1e-3);
  avatar_.edge_mm.front() = 0;
  EXPECT_NEAR(Of(a)[23], std::min(5.0, 20 / edges), 1e-3);
}

TEST_F(DrivingFeaturesTest, LeftAndMisfitAreScaledAndCapped) {
  EXPECT_NEAR(Of(3)[25], 0.3, 1e-6);
  EXPECT_NEAR(Of(3)[26], 1.5, 1e-6);
  frame_.misfit[3] = 7;
  EXPECT_EQ(Of(3)[26], 4);
  avatar_.left_mm[3] = 70;
  EXPECT_EQ(Of(3)[25], kMostFeature);
  frame_.track.state.root.translation() << 0, 0, 1e5;
  frame_.track.state.root.linear().setIdentity();
  EXPECT_EQ(Of(3)[19], -kMostFeature);
}

TEST_F(DrivingFeaturesTest, RaysAreSummedInTheAxesOfTheVertex) {
  Ray(3, {1, 0, 0});
  Ray(3, {0, 0, 1}, true);
  Ray(3, {0, 1, 0});
  Ray(4, {0, 0, 1}, true);
  Ray(9, {1, 2, 2});
  axes_.assign(axes_.size(), Eigen::Matrix3f::Identity());
  const std::vector<float> two = Of(3);
  // I - d d^T of x and of y, over two.
  ExpectVector(two, 4, {0.5, 0.5, 1});
  ExpectVector(two, 7, {0, 0, 0});
  EXPECT_NEAR(two[10], 2.0 / 3, 1e-6);
  ExpectVector(two, 11, {0.5, 0.5, 0});
  const std::vector<float> one = Of(9);
  ExpectVector(one, 4, {8.0 / 9, 5.0 / 9, 5.0 / 9});
  ExpectVector(one, 7, {-2.0 / 9, -2.0 / 9, -4.0 / 9});
  EXPECT_NEAR(one[10], 1.0 / 3, 1e-6);
  ExpectVector(one, 11, Eigen::Vector3d(1, 2, 2) / 3);
  for (const int vertex : {4, 5}) {
    const std::vector<float> none = Of(vertex);
    for (size_t at = 4; at < 14; ++at) EXPECT_EQ(none[at], 0) << vertex;
  }
  // A turn of the axes turns the rays.
  axes_.assign(axes_.size(),
               Eigen::AngleAxisf(static_cast<float>(M_PI / 2), Eigen::Vector3f::UnitZ()).toRotationMatrix());
  ExpectVector(Of(9), 11, Eigen::Vector3d(2, -1, 2) / 3);
}

}  // namespace
}  // namespace weft
