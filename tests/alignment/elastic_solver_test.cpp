#include "alignment/elastic_solver.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <array>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;
using testing::Mapped;
using testing::MaxDistance;
using testing::Rolled;

struct Sheet {
  explicit Sheet(int rows, int cols)
      : rest(FlatSheet(rows, cols)), graph(BuildMeshGraph(rest)), slices(SliceMesh(rest, graph)) {}
  TriangleMesh rest;
  MeshGraph graph;
  SlicedMesh slices;
};

Deformation RandomDeformation(const TriangleMesh& rest, double size, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-size, size);
  const auto vector = [&] { return Eigen::Vector3d(number(random), number(random), number(random)); };
  Deformation deformation;
  for (const Eigen::Vector3d& v : rest.vertices_mm) {
    const Eigen::Vector3d turn = vector();
    deformation.position_mm.push_back(v + vector());
    deformation.rotation.push_back(Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix());
  }
  return deformation;
}

Deformation Placed(const TriangleMesh& rest, const Eigen::Isometry3d& motion) {
  Deformation deformation;
  for (const Eigen::Vector3d& v : rest.vertices_mm) deformation.position_mm.push_back(motion * v);
  deformation.rotation.assign(rest.vertices_mm.size(), motion.rotation());
  return deformation;
}

TEST(DistortionEnergy, IsZeroForRigidMotions) {
  const Sheet sheet(6, 5);
  const Deformation moved = Placed(sheet.rest, testing::SomeMotion());
  EXPECT_LT(DistortionEnergy(sheet.rest, sheet.graph, moved), 1e-18);
  EXPECT_LT(ReducedDistortionEnergy(sheet.rest, sheet.graph, moved, {3, 0.5}), 1e-18);
}

TEST(DistortionEnergy, ReducedFormEqualsEquation2) {
  const Sheet sheet(6, 5);
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    const Deformation deformation = RandomDeformation(sheet.rest, 1.5, seed);
    const double plain = DistortionEnergy(sheet.rest, sheet.graph, deformation);
    EXPECT_GT(plain, 1);
    EXPECT_NEAR(ReducedDistortionEnergy(sheet.rest, sheet.graph, deformation, {3, 0.5}), plain,
                1e-12 * plain);
  }
}

// Polar decomposition of the edges' moment, vertex by vertex.
TEST(FitRigid, FindsTheRotationsOfTheSingularValueDecomposition) {
  const Sheet sheet(9, 8);
  Deformation deformation = Placed(sheet.rest, Eigen::Isometry3d::Identity());
  deformation.position_mm = Mapped(sheet.rest.vertices_mm, [](const Eigen::Vector3d& p) {
    return testing::SomeMotion() * Rolled({1.1 * p.x(), p.y(), 0}, 9);
  });
  deformation.rotation.assign(deformation.position_mm.size(), testing::SomeMotion().rotation());
  const std::vector<Eigen::Vector3d> position_mm = deformation.position_mm;
  FitRigid(sheet.slices, &deformation);
  for (int v = 0; v < sheet.graph.vertices; ++v) {
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    for (int i = sheet.graph.first[v]; i < sheet.graph.first[v + 1]; ++i) {
      const int other = sheet.graph.neighbor[i];
      moment += (position_mm[other] - position_mm[v]) *
                (sheet.rest.vertices_mm[other] - sheet.rest.vertices_mm[v]).transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moment, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV()).determinant() < 0 ? -1 : 1);
    const Eigen::Matrix3d expected = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    EXPECT_LT((deformation.rotation[v] - expected).norm(), 1e-3) << v;
  }
}

// The oracle: the same minimum by Gauss-Newton on positions and rotations, with Eq. 2 as the paper writes it.
struct EdgeResidual {
  Eigen::Vector3d rest_k, rest_l;
  template <typename T>
  bool operator()(const T* c_k, const T* r_k, const T* c_l, const T* r_l, T* residual) const {
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d s = rest_k + 0.5 * i * (rest_l - rest_k);
      const auto image = [&s](const Eigen::Vector3d& rest, const T* c, const T* r, T* out) {
        const T local[3] = {T(s.x() - rest.x()), T(s.y() - rest.y()), T(s.z() - rest.z())};
        ceres::AngleAxisRotatePoint(r, local, out);
        for (int axis = 0; axis < 3; ++axis) out[axis] += c[axis];
      };
      T by_k[3], by_l[3];
      image(rest_k, c_k, r_k, by_k);
      image(rest_l, c_l, r_l, by_l);
      for (int axis = 0; axis < 3; ++axis) residual[3 * i + axis] = by_k[axis] - by_l[axis];
    }
    return true;
  }
};

struct TargetResidual {
  Eigen::Vector3d target;
  Eigen::Matrix3d root_weight;  // its square is the weight
  template <typename T>
  bool operator()(const T* c, T* residual) const {
    for (int i = 0; i < 3; ++i) {
      residual[i] = T(0);
      for (int j = 0; j < 3; ++j) residual[i] += root_weight(i, j) * (c[j] - target[j]);
    }
    return true;
  }
};

struct OracleResult {
  double energy = 0;
  std::vector<Eigen::Vector3d> position_mm;
};

OracleResult SolveByGaussNewton(const Sheet& sheet, const ElasticProblem& elastic) {
  std::vector<std::array<double, 3>> c, r;
  for (const Eigen::Vector3d& p : elastic.targets_mm) {
    c.push_back({p.x(), p.y(), p.z()});
    r.push_back({0, 0, 0});
  }
  ceres::Problem problem;
  for (const MeshEdge& edge : sheet.graph.edges) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<EdgeResidual, 9, 3, 3, 3, 3>(new EdgeResidual{
                                 sheet.rest.vertices_mm[edge.a], sheet.rest.vertices_mm[edge.b]}),
                             nullptr, c[edge.a].data(), r[edge.a].data(), c[edge.b].data(), r[edge.b].data());
  }
  for (size_t v = 0; v < c.size(); ++v) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<TargetResidual, 3, 3>(new TargetResidual{
                                 elastic.targets_mm[v], elastic.weights[v].llt().matrixU()}),
                             nullptr, c[v].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // SuiteSparse is partly GPL
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_EQ(summary.termination_type, ceres::CONVERGENCE) << summary.BriefReport();
  OracleResult result{2 * summary.final_cost, {}};  // Ceres halves its cost
  for (const auto& p : c) result.position_mm.emplace_back(p[0], p[1], p[2]);
  return result;
}

// A rolled sheet with noise, a quarter of it held only weakly.
ElasticProblem NoisyProblem(const Sheet& sheet, int cols, float weak) {
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, 0.4);
  ElasticProblem problem;
  for (int v = 0; v < sheet.graph.vertices; ++v) {
    const Eigen::Vector3d error(noise(random), noise(random), noise(random));
    problem.targets_mm.push_back(Rolled(sheet.rest.vertices_mm[v], 25) + error);
    const bool hidden = std::abs(v % cols - 7) <= 3 && std::abs(v / cols - 6) <= 3;
    // Every third target is vague along one direction, as points seen by two cameras are.
    const Eigen::Vector3d vague = Eigen::Vector3d(1, v % 5, v % 7).normalized();
    const double left = v % 3 == 0 ? 0.05 : 1;
    problem.weights.push_back((hidden ? weak : 1) *
                              (Eigen::Matrix3d::Identity() - (1 - left) * vague * vague.transpose()));
  }
  return problem;
}

class AgainstGaussNewton : public ::testing::TestWithParam<float> {};

TEST_P(AgainstGaussNewton, ReachesTheSameMinimum) {
  const int rows = 13, cols = 15;
  const Sheet sheet(rows, cols);
  const ElasticProblem problem = NoisyProblem(sheet, cols, GetParam());
  const OracleResult oracle = SolveByGaussNewton(sheet, problem);

  Deformation deformation = Placed(sheet.rest, Eigen::Isometry3d::Identity());
  deformation.position_mm = problem.targets_mm;
  FitRigid(sheet.slices, &deformation);
  ElasticOptions options;
  options.distortion = {.stretch = 3, .bending = 0.5};
  options.tolerance = 1e-6;
  options.max_iterations = 2000;
  const auto report = SolveElastic(sheet.slices, sheet.graph, problem, options, &deformation);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->converged);

  // The energy by its definition, from what the solver returned.
  const double energy = DetectionEnergy(problem.targets_mm, problem.weights, deformation.position_mm) +
                        DistortionEnergy(sheet.rest, sheet.graph, deformation);
  EXPECT_NEAR(report->energy_after, energy, 1e-4 * energy);
  EXPECT_LT(energy, 1.001 * oracle.energy);
  EXPECT_GT(energy, 0.999 * oracle.energy);
  EXPECT_LT(MaxDistance(deformation.position_mm, oracle.position_mm), 0.05);
}

INSTANTIATE_TEST_SUITE_P(WeightOfHiddenVertices, AgainstGaussNewton, ::testing::Values(1.0f, 0.1f, 0.01f));

TEST(SolveElastic, LeavesAnUndistortedMeshWhereItIs) {
  const Sheet sheet(10, 10);
  Deformation deformation = Placed(sheet.rest, testing::SomeMotion());
  const std::vector<Eigen::Vector3d> start = deformation.position_mm;
  const ElasticProblem problem{start,
                               std::vector<Eigen::Matrix3d>(start.size(), Eigen::Matrix3d::Identity())};
  const auto report = SolveElastic(sheet.slices, sheet.graph, problem, {}, &deformation);
  ASSERT_TRUE(report.ok());
  EXPECT_LT(report->energy_after, 1e-6);
  EXPECT_LT(MaxDistance(deformation.position_mm, start), 1e-3);
}

// From a crumpled start many full steps gain nothing. They are shortened by the energy that they met; halving
// them takes 1.9 evaluations per iteration here.
TEST(SolveElastic, TakesFewEvaluationsWhereStepsAreTooLong) {
  const Sheet sheet(40, 40);
  int evaluations = 0, iterations = 0;
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    Deformation deformation = RandomDeformation(sheet.rest, 2.5, seed);
    ElasticProblem problem{deformation.position_mm, {}, {}};
    problem.weights.assign(problem.targets_mm.size(), 0.01 * Eigen::Matrix3d::Identity());
    ElasticOptions options;
    options.tolerance = 1e-5;
    const auto report = SolveElastic(sheet.slices, sheet.graph, problem, options, &deformation);
    ASSERT_TRUE(report.ok());
    EXPECT_TRUE(report->converged);
    evaluations += report->evaluations;
    iterations += report->iterations;
  }
  EXPECT_LT(evaluations, 1.6 * iterations);
}

TEST(SolveElastic, NamesTheOptionThatIsWrong) {
  ElasticOptions options;
  options.tolerance = 0;
  EXPECT_EQ(options.Validate().message(), "elastic.tolerance must be positive");
}

}  // namespace
}  // namespace weft
