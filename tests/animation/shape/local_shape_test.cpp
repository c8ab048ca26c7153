#include "animation/shape/local_shape.h"

#include <gtest/gtest.h>

#include <cmath>

#include "animation/shape/edge_vectors.h"
#include "tests/animation/recorded.h"
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

TEST(LocalShapeOptions, AreChecked) {
  LocalShapeOptions options;
  EXPECT_EQ(options.regions, 30);
  EXPECT_EQ(options.components, 12);
  EXPECT_TRUE(options.Validate().ok());
  for (const auto& [regions, is_good] :
       {std::pair{-1, false}, std::pair{0, true}, std::pair{200, true}, std::pair{201, false}}) {
    options = {};
    options.regions = regions;
    EXPECT_EQ(options.Validate().ok(), is_good) << regions;
  }
  options = {};
  options.components = 1;
  options.steps = 1;
  EXPECT_TRUE(options.Validate().ok());
  options.components = 0;
  EXPECT_EQ(options.Validate().message(), "local shape: components must be at least 1");
  options = {};
  options.steps = 0;
  EXPECT_EQ(options.Validate().message(), "local shape: steps must be at least 1");
  for (double LocalShapeOptions::*field : {&LocalShapeOptions::spread, &LocalShapeOptions::reach_mm}) {
    options = {};
    options.*field = 0;
    EXPECT_EQ(options.Validate().message(), "local shape: spread and reach_mm must be positive");
  }
}

// Weights fall with the square of the way left to a radius of 1.6 of the furthest way.
TEST(DivideShape, WeightsFallWithTheWayToTheMiddles) {
  const Template tube = WavingTube::Garment();
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  LocalShapeOptions options;
  options.regions = 4;
  const ShapeRegions regions = DivideShape(tube.rest, graph, options);
  ASSERT_EQ(regions.count, 4);
  const FarPoints middles = ChooseFarPoints(4, tube.rest, graph);
  const double radius = 1.6 * middles.furthest_mm;
  for (size_t v = 0; v < tube.rest.vertices_mm.size(); ++v) {
    std::vector<std::pair<int, double>> expected;
    double sum = 0;
    for (int r = 0; r < 4; ++r) {
      const double left = radius - middles.ways_mm[static_cast<size_t>(r)][v];
      if (left <= 0) continue;
      expected.emplace_back(r, left * left);
      sum += left * left;
    }
    ASSERT_EQ(regions.of_vertex[v].size(), expected.size()) << v;
    for (size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(regions.of_vertex[v][i].first, expected[i].first);
      EXPECT_NEAR(regions.of_vertex[v][i].second, expected[i].second / sum, 1e-9);
    }
  }
}

// Of two regions, whose covariance has its inverse in closed form.
TEST(DivideShape, NeighboursDifferLittle) {
  const Template tube = WavingTube::Garment();
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  LocalShapeOptions options;
  options.regions = 2;
  options.spread = 2;
  const FarPoints middles = ChooseFarPoints(2, tube.rest, graph);
  const double way = middles.ways_mm[0][static_cast<size_t>(middles.vertices[1])];
  for (const double reach_mm : {300.0, 100 * way}) {
    options.reach_mm = reach_mm;
    const double alike = std::exp(-way / reach_mm);
    // Along (1, 1) and (1, -1); the smaller is 2 % of the larger at least.
    const double large = 4 * (1 + alike), small = std::max(4 * (1 - alike), 0.02 * large);
    const Eigen::MatrixXd information = DivideShape(tube.rest, graph, options).information;
    EXPECT_NEAR(information(0, 0), 0.5 * (1 / large + 1 / small), 1e-9);
    EXPECT_NEAR(information(1, 1), 0.5 * (1 / large + 1 / small), 1e-9);
    EXPECT_NEAR(information(0, 1), 0.5 * (1 / large - 1 / small), 1e-9);
    EXPECT_NEAR(information(1, 0), 0.5 * (1 / large - 1 / small), 1e-9);
  }
  options.regions = 0;
  const ShapeRegions none = DivideShape(tube.rest, graph, options);
  EXPECT_EQ(none.count, 0);
  EXPECT_TRUE(none.of_vertex[0].empty());
}

TEST_F(FittedShape, PointsAreMeanAndBasisByTheirCoefficients) {
  const Template tube = WavingTube::Garment();
  const LocalShape shape(space_, DivideShape(tube.rest, BuildMeshGraph(tube.rest), options_), options_);
  EXPECT_EQ(shape.local_components(), 3);
  ShapeState state;
  state.z = Eigen::VectorXd::LinSpaced(6, -1, 1);
  const auto expect_points = [&] {
    for (const int vertex : {0, 77, 200}) {
      Eigen::VectorXd z = state.z;
      if (state.local.size() > 0)
        for (const auto& [region, weight] : shape.regions().of_vertex[static_cast<size_t>(vertex)])
          for (int k = 0; k < 3; ++k) z[k] += weight * state.local(region, k);
      for (int axis = 0; axis < 3; ++axis) {
        const size_t at = 3 * static_cast<size_t>(vertex) + static_cast<size_t>(axis),
                     size = 3 * static_cast<size_t>(space_.vertices);
        double expected = space_.mean_mm[at];
        for (size_t k = 0; k < 6; ++k)
          expected += z[static_cast<Eigen::Index>(k)] * space_.sigma_mm[k] * space_.basis[k * size + at];
        EXPECT_NEAR(shape.PointOf(vertex, state)[axis], expected, 1e-3);
      }
    }
  };
  expect_points();
  state.local = Eigen::MatrixXd::Random(5, 3);
  expect_points();
  // No more components are local than the space has.
  options_.components = 99;
  EXPECT_EQ(LocalShape(space_, {}, options_).local_components(), 6);
}

TEST_F(FittedShape, StepsStayAsTheyAre) {
  const Template tube = WavingTube::Garment();
  const LocalShape shape(space_, DivideShape(tube.rest, BuildMeshGraph(tube.rest), options_), options_);
  ShapeState state;
  state.z = Eigen::VectorXd::Zero(6);
  Recorded recorded;
  for (const bool with_regions : {false, false, true, true}) {
    recorded.Add("change", shape.Step(rays_, weight_, prior_, with_regions ? 6 : 4, with_regions, &state));
    recorded.Add("root", state.root.matrix());
    recorded.Add("z", state.z);
  }
  recorded.Add("local", state.local);
  recorded.Add("mesh", shape.MeshOf(state));
  recorded.Expect();
}

}  // namespace
}  // namespace weft
