#include "animation/rays/isometric_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "alignment/mesh.h"
#include "tests/animation/recorded.h"

namespace weft {
namespace {

using Eigen::Vector3d;

constexpr int kSide = 21;
constexpr double kCellMm = 10;

// A square sheet rolled to a piece of a cylinder about the y axis: lengths stay but for chords, which are
// shorter than their arcs by less than 0.1 %. Of curvature 0 it is flat; its middle is the origin.
TriangleMesh Rolled(double curvature_per_mm) {
  TriangleMesh out;
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      const double s = kCellMm * (column - kSide / 2), y = kCellMm * (row - kSide / 2);
      const double k = curvature_per_mm;
      if (std::abs(k) < 1e-9) {
        out.vertices_mm.emplace_back(s, y, 0);
      } else {
        out.vertices_mm.emplace_back(std::sin(k * s) / k, y, (1 - std::cos(k * s)) / k);
      }
    }
  for (int row = 0; row + 1 < kSide; ++row)
    for (int column = 0; column + 1 < kSide; ++column) {
      const int a = row * kSide + column;
      out.faces.push_back({a, a + 1, a + kSide});
      out.faces.push_back({a + 1, a + kSide + 1, a + kSide});
    }
  return out;
}

struct Sheet {
  Sheet() : graph(BuildMeshGraph(Rolled(0))) {
    const std::vector<Vector3d> flat = Rolled(0).vertices_mm;
    for (const MeshEdge& e : graph.edges)
      mean_mm.push_back(static_cast<float>((flat[e.a] - flat[e.b]).norm()));
    follow.assign(graph.edges.size(), 0);
    spread_mm.assign(graph.edges.size(), 0.02f);
  }
  IsometricFit Fit(const IsometricOptions& options = {}) const {
    return {graph, {mean_mm, follow, spread_mm}, options};
  }

  MeshGraph graph;
  std::vector<float> mean_mm, follow, spread_mm;
};

// One camera, 1.5 m away, sees every vertex to 0.05 mm, and a weak pull holds all.
std::vector<RayEvidence> SeenByOne(const std::vector<Vector3d>& truth, const std::vector<Vector3d>& carrier) {
  const Vector3d eye(300, 100, -1500);
  std::vector<RayEvidence> out;
  for (size_t v = 0; v < truth.size(); ++v) {
    const Vector3d d = (truth[v] - eye).normalized();
    const Eigen::Matrix3d across = 400 * (Eigen::Matrix3d::Identity() - d * d.transpose());
    const Eigen::Matrix3d weak = 1e-6 * Eigen::Matrix3d::Identity();
    out.push_back({across + weak, across * eye + weak * carrier[v], 1});
  }
  return out;
}

double WorstOff(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double worst = 0;
  for (size_t v = 0; v < a.size(); ++v) worst = std::max(worst, (a[v] - b[v]).norm());
  return worst;
}

IsometricOptions Exact() {
  IsometricOptions out;
  out.max_steps = 60;
  out.tolerance_mm = 1e-4;
  out.least_strain = 0.002;
  out.bend_share = 10;
  return out;
}

TEST(IsometricFit, OneViewAndLengthsGiveDepth) {
  const Sheet sheet;
  const auto truth = Rolled(1 / 120.0).vertices_mm, carrier = Rolled(1 / 200.0).vertices_mm;
  ASSERT_GT(WorstOff(carrier, truth), 15);
  std::vector<Vector3d> x = carrier;
  const absl::Status status = sheet.Fit(Exact()).Solve(SeenByOne(truth, carrier), carrier, &x);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_LT(WorstOff(x, truth), 0.6);
}

TEST(IsometricFit, TheStartDecidesWhichWayABumpGoes) {
  // Seen along its axis a roll and its mirror image have the same lines of sight but for perspective.
  const Sheet sheet;
  const auto truth = Rolled(1 / 300.0).vertices_mm, mirrored = Rolled(-1 / 300.0).vertices_mm;
  std::vector<RayEvidence> pulls;
  for (size_t v = 0; v < truth.size(); ++v) {
    const Eigen::Matrix3d across = Eigen::Vector3d(400, 400, 1e-6).asDiagonal();
    pulls.push_back({across, across * truth[v], 1});
  }
  const auto flat = Rolled(0).vertices_mm;
  for (const auto& side : {truth, mirrored}) {
    std::vector<Vector3d> x = flat;
    for (size_t v = 0; v < x.size(); ++v) x[v].z() = 0.5 * side[v].z();
    ASSERT_TRUE(sheet.Fit(Exact()).Solve(pulls, flat, &x).ok());
    double off = 0;
    for (size_t v = 0; v < x.size(); ++v) off = std::max(off, std::abs(x[v].z() - x[220].z() - side[v].z()));
    EXPECT_LT(off, 1.5);
  }
}

TEST(IsometricFit, AFactorThatServesSeveralStepsEndsAtTheSameMesh) {
  const Sheet sheet;
  const auto truth = Rolled(1 / 150.0).vertices_mm, carrier = Rolled(1 / 200.0).vertices_mm;
  IsometricOptions often = Exact(), seldom = Exact();
  often.steps_of_factor = 1, seldom.steps_of_factor = 6;
  often.max_steps = seldom.max_steps = 200;
  std::vector<Vector3d> x = carrier, y = carrier;
  ASSERT_TRUE(sheet.Fit(often).Solve(SeenByOne(truth, carrier), carrier, &x).ok());
  ASSERT_TRUE(sheet.Fit(seldom).Solve(SeenByOne(truth, carrier), carrier, &y).ok());
  EXPECT_LT(WorstOff(x, y), 0.05);
}

// A sheet that is stretched everywhere by as much as its carrier is: the carrier tells.
TEST(IsometricFit, FollowsTheCarriersLengthsAsFarAsItIsToldTo) {
  Sheet sheet;
  auto truth = Rolled(1 / 150.0).vertices_mm;
  for (Vector3d& p : truth) p *= 1.02;
  for (const float follow : {0.0f, 1.0f}) {
    sheet.follow.assign(sheet.graph.edges.size(), follow);
    std::vector<Vector3d> x = truth;
    ASSERT_TRUE(sheet.Fit(Exact()).Solve(SeenByOne(truth, truth), truth, &x).ok());
    EXPECT_EQ(WorstOff(x, truth) < 0.1, follow == 1);
    EXPECT_EQ(WorstOff(x, truth) > 10, follow == 0);
  }
}

TEST(IsometricFit, WithoutAnyPullSaysSo) {
  const Sheet sheet;
  const auto carrier = Rolled(0).vertices_mm;
  std::vector<Vector3d> x = carrier;
  const absl::Status status = sheet.Fit().Solve(std::vector<RayEvidence>(carrier.size()), carrier, &x);
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
}

TEST(IsometricFit, RefusesOptionsThatMeanNothing) {
  IsometricOptions options;
  options.steps_of_factor = 0;
  EXPECT_THAT(options.Validate().message(), testing::HasSubstr("steps_of_factor"));
  options = {};
  options.least_strain = 0;
  EXPECT_THAT(options.Validate().message(), testing::HasSubstr("least_strain"));
}

TEST(IsometricFit, MeshesStayAsTheyAre) {
  Sheet sheet;
  sheet.follow.assign(sheet.graph.edges.size(), 0.3f);
  for (size_t e = 0; e < sheet.spread_mm.size(); ++e) sheet.spread_mm[e] = 0.05f * static_cast<float>(e % 9);
  const auto truth = Rolled(1 / 120.0).vertices_mm, carrier = Rolled(1 / 200.0).vertices_mm;
  Recorded recorded;
  for (const int steps : {1, 2, 12}) {
    IsometricOptions options;
    options.max_steps = steps, options.tolerance_mm = 1e-3;
    IsometricFit fit = sheet.Fit(options);
    std::vector<Vector3d> x = carrier;
    ASSERT_TRUE(fit.Solve(SeenByOne(truth, carrier), carrier, &x).ok());
    recorded.Add("first", x);
    // Rays that changed a little: the factor of before serves first.
    ASSERT_TRUE(fit.Solve(SeenByOne(Rolled(1 / 125.0).vertices_mm, carrier), carrier, &x, true).ok());
    recorded.Add("alike", x);
    ASSERT_TRUE(fit.Solve(SeenByOne(Rolled(1 / 80.0).vertices_mm, carrier), carrier, &x, false).ok());
    recorded.Add("other", x);
  }
  recorded.Expect();
}

// A step that would be longer than 20 mm is shortened to that.
TEST(IsometricFit, StepsAreBounded) {
  const Sheet sheet;
  auto far = Rolled(0).vertices_mm;
  for (Vector3d& p : far) p.y() += 300;
  IsometricOptions options = Exact();
  options.max_steps = 1;
  std::vector<Vector3d> x = Rolled(0).vertices_mm;
  ASSERT_TRUE(sheet.Fit(options).Solve(SeenByOne(far, far), far, &x).ok());
  double longest = 0;
  for (size_t v = 0; v < x.size(); ++v) longest = std::max(longest, (x[v] - Rolled(0).vertices_mm[v]).norm());
  EXPECT_NEAR(longest, 20, 1e-6);
}

}  // namespace
}  // namespace weft
