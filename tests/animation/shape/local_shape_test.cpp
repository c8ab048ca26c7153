#include "animation/shape/local_shape.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

class FittedShape : public testing::Test {
 protected:
  void SetUp() override {
    const MeshFrames frames{60, [](int frame) { return WavingTube::At(3 * frame, frame % 5); }};
    space_ = *LearnShapeSpace(frames, {.components = 6});
    options_.regions = 5;
    options_.components = 3;
    const std::vector<CameraModel> cameras = CamerasAround(3);
    const std::vector<Eigen::Vector3d> truth = WavingTube::At(17, 9);
    for (size_t v = 0; v < truth.size(); ++v) {
      const CameraModel& camera = cameras[v % 3];
      const Eigen::Vector3d from = camera.CenterWorld();
      rays_.push_back({static_cast<int>(v), static_cast<int>(v % 3), from, (truth[v] - from).normalized(),
                       1e-4, camera.fx_px});
      weight_.push_back(0.05 + 0.01 * static_cast<double>(v % 7));
    }
    prior_ = {Eigen::VectorXd::Constant(6, 0.3), Eigen::VectorXd::Constant(6, 2)};
  }

  double Cost(const LocalShape& shape, const ShapeState& state) const {
    double out = state.z.squaredNorm() + (state.z - prior_.expected).cwiseAbs2().dot(prior_.information);
    for (size_t i = 0; i < rays_.size(); ++i)
      out += weight_[i] * rays_[i].OffsetTo(state.root * shape.PointOf(rays_[i].vertex, state)).squaredNorm();
    if (state.local.size() > 0)
      out += (state.local.transpose() * shape.regions().information * state.local).trace();
    return out;
  }

  // By both sides, over the step.
  template <typename Change>
  double Slope(const LocalShape& shape, const ShapeState& state, const Change& change) const {
    constexpr double kStep = 1e-4;
    ShapeState more = state, less = state;
    change(kStep, &more), change(-kStep, &less);
    return (Cost(shape, more) - Cost(shape, less)) / (2 * kStep);
  }

  ShapeSpace space_;
  LocalShapeOptions options_;
  std::vector<VertexRay> rays_;
  std::vector<double> weight_;
  ShapePrior prior_;
};

// Steps end where no unknown, by itself, makes the cost lower: of the garment, then of its regions as well.
TEST_F(FittedShape, StepsEndWhereTheCostIsLowest) {
  const Template tube = WavingTube::Garment();
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  const LocalShape shape(space_, DivideShape(tube.rest, graph, options_), options_);
  ShapeState state;
  state.z = Eigen::VectorXd::Zero(6);
  for (const bool with_regions : {false, true}) {
    const double before = Cost(shape, state);
    double change = 1;
    for (int step = 0; step < 12 && change > 1e-7; ++step)
      change = shape.Step(rays_, weight_, prior_, 6, with_regions, &state);
    EXPECT_LT(change, 1e-6);
    EXPECT_GE(change, 0);
    EXPECT_LT(Cost(shape, state), before);
    const double small = 1e-3 * Cost(shape, state);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(Slope(shape, state, [&](double by, ShapeState* s) { s->root.translation()[axis] += by; }),
                  0, small);
      EXPECT_NEAR(Slope(shape, state,
                        [&](double by, ShapeState* s) {
                          s->root.linear() =
                              Eigen::AngleAxisd(by, Eigen::Vector3d::Unit(axis)) * s->root.linear();
                        }),
                  0, 100 * small);
    }
    for (int k = 0; k < 6; ++k)
      EXPECT_NEAR(Slope(shape, state, [&](double by, ShapeState* s) { s->z[k] += by; }), 0, small) << k;
    if (!with_regions) continue;
    for (int r = 0; r < 5; ++r)
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(Slope(shape, state, [&](double by, ShapeState* s) { s->local(r, k) += by; }), 0, small);
  }
}

TEST_F(FittedShape, PointsAreThoseOfTheMesh) {
  const Template tube = WavingTube::Garment();
  const LocalShape shape(space_, DivideShape(tube.rest, BuildMeshGraph(tube.rest), options_), options_);
  ShapeState state;
  state.root = Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY());
  state.z = Eigen::VectorXd::LinSpaced(6, -1, 1);
  state.local = Eigen::MatrixXd::Random(5, 3);
  const std::vector<Eigen::Vector3d> points = shape.PointsOf(rays_, state), mesh = shape.MeshOf(state);
  for (size_t i = 0; i < rays_.size(); ++i) {
    EXPECT_EQ(points[i], shape.PointOf(rays_[i].vertex, state));
    EXPECT_LT((state.root * points[i] - mesh[static_cast<size_t>(rays_[i].vertex)]).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace weft
