#include "alignment/align.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cstring>

#include "tests/alignment/cloth_sheets.h"
#include "tests/alignment/paper_options.h"

namespace weft {
namespace {

using testing::FlatSheet;
using ::testing::HasSubstr;
using testing::kCellMm;
using testing::Mapped;
using testing::MaxDistance;
using testing::MeanError;
using testing::Measure;
using testing::Rolled;
using testing::SheetTemplate;
using testing::SomeMotion;

constexpr int kRows = 40, kCols = 50;
constexpr double kRadiusMm = 45;

std::vector<Eigen::Vector3d> RolledAndMoved(const TriangleMesh& rest) {
  return Mapped(rest.vertices_mm,
                [](const Eigen::Vector3d& p) { return SomeMotion() * Rolled(p, kRadiusMm); });
}

// Within 8 cells of the sheet's middle.
bool InHiddenPatch(int v) { return std::hypot(v / kCols - kRows / 2, v % kCols - kCols / 2) <= 8; }

TEST(Align, FindsRigidMotionsWithoutDistortion) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto truth = Mapped(garment.rest.vertices_mm, [](const auto& p) { return SomeMotion() * p; });
  for (const AlignOptions& options : {testing::PaperAlignment(), AlignOptions{}}) {
    const auto result = Align(garment, Measure(truth, 0, 1), options);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_LT(MaxDistance(result->mesh.vertices_mm, truth), 2e-3);
    EXPECT_LT(result->stages.back().energy_after, 1e-4);
    EXPECT_EQ(result->outliers, 0);
  }
}

TEST(Align, RecoversAHiddenPatchOfABentSheet) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto truth = RolledAndMoved(garment.rest);
  const auto visible = [](int v) { return !InHiddenPatch(v); };
  const auto result = Align(garment, Measure(truth, 0.3, 1, visible), AlignOptions{});
  ASSERT_TRUE(result.ok()) << result.status();
  // The chord across the patch runs up to 5 mm below the arc.
  EXPECT_LT(MeanError(result->mesh.vertices_mm, truth, InHiddenPatch), 0.6);
  EXPECT_LT(MeanError(result->mesh.vertices_mm, truth, visible), 0.2);  // noise alone: 0.48
}

TEST(Align, BeatsThePaperOnHiddenCloth) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto truth = RolledAndMoved(garment.rest);
  const auto targets = Measure(truth, 0.3, 2, [](int v) { return !InHiddenPatch(v); });
  const auto best = Align(garment, targets, AlignOptions{}),
             paper = Align(garment, targets, testing::PaperAlignment());
  ASSERT_TRUE(best.ok() && paper.ok());
  EXPECT_LT(MeanError(best->mesh.vertices_mm, truth, InHiddenPatch),
            0.5 * MeanError(paper->mesh.vertices_mm, truth, InHiddenPatch));
}

// A flat sheet with a fold across it, up or down: the slope along the way is steepest halfway up and down,
// and the way is as long as the flat sheet.
std::vector<Eigen::Vector3d> Folded(const TriangleMesh& rest, double steepest) {
  constexpr double kFrom = 15 * kCellMm, kTo = 35 * kCellMm, kStep = 0.01;
  std::vector<Eigen::Vector2d> way(1, Eigen::Vector2d::Zero());
  for (double s = 0; s < kCols * kCellMm; s += kStep) {
    const double inside = std::clamp((s - kFrom) / (kTo - kFrom), 0.0, 1.0);
    const double slope = steepest * std::sin(2 * M_PI * inside);
    way.push_back(way.back() + kStep * Eigen::Vector2d(std::cos(slope), std::sin(slope)));
  }
  return Mapped(rest.vertices_mm, [&](const Eigen::Vector3d& p) {
    const Eigen::Vector2d& at = way[static_cast<size_t>(std::lround(p.x() / kStep))];
    return SomeMotion() * Eigen::Vector3d(at.x(), p.y(), at.y());
  });
}

TEST(Align, StartsHiddenClothWhereAnotherMeshHasIt) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto hidden = [](int v) { return v % kCols > 14 && v % kCols < 36; };
  for (const double side : {1.0, -1.0}) {  // both fit what is seen
    const auto truth = Folded(garment.rest, 0.8 * side), before = Folded(garment.rest, 0.7 * side);
    const auto targets = Measure(truth, 0.02, 1, [&](int v) { return !hidden(v); });
    const auto result = Align(garment, targets, AlignOptions{}, {.start_mm = &before});
    ASSERT_TRUE(result.ok()) << result.status();
    // On the other side it would be off by ten.
    EXPECT_LT(MeanError(result->mesh.vertices_mm, truth, hidden), 1);
  }
}

// Stretched by a fifth around a cylinder, and a little narrower along it.
TEST(Align, LocalStretchKeepsHiddenClothAsLongAsTheClothAroundIt) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto truth = Mapped(garment.rest.vertices_mm, [](const Eigen::Vector3d& p) {
    return SomeMotion() * Rolled({1.2 * p.x(), 0.95 * p.y(), 0}, kRadiusMm);
  });
  auto targets = Measure(truth, 0.05, 1, [](int v) { return !InHiddenPatch(v); });
  for (VertexTarget& t : targets) t.sigma_mm = 0.05;
  AlignOptions options;
  const auto stiff = Align(garment, targets, options);
  options.stretch_rings = 4;
  const auto stretched = Align(garment, targets, options);
  ASSERT_TRUE(stiff.ok() && stretched.ok());
  EXPECT_LT(MeanError(stretched->mesh.vertices_mm, truth, InHiddenPatch),
            0.4 * MeanError(stiff->mesh.vertices_mm, truth, InHiddenPatch));
}

TEST(Align, RefusesStartsOfAnotherMesh) {
  const Template garment = SheetTemplate(FlatSheet(8, 8));
  const auto targets = Measure(garment.rest.vertices_mm, 0, 1);
  std::vector<Eigen::Vector3d> start(63, Eigen::Vector3d::Zero());
  EXPECT_THAT(Align(garment, targets, AlignOptions{}, {.start_mm = &start}).status().message(),
              HasSubstr("start: has 63 vertices, the template 64"));
  start.assign(64, Eigen::Vector3d::Zero());
  start[5].x() = std::nan("");
  EXPECT_THAT(Align(garment, targets, AlignOptions{}, {.start_mm = &start}).status().message(),
              HasSubstr("start: vertex 5 is not finite"));
}

TEST(Align, ShowsTheVerticesAfterEachStage) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto truth = RolledAndMoved(garment.rest);
  std::vector<std::string> stages;
  std::vector<double> error_mm;
  AlignContext context;
  context.watch = [&](const std::string& stage, const std::vector<Eigen::Vector3d>& vertices_mm) {
    stages.push_back(stage);
    error_mm.push_back(MeanError(vertices_mm, truth, InHiddenPatch));
  };
  const auto targets = Measure(truth, 0, 1, [](int v) { return !InHiddenPatch(v); });
  ASSERT_TRUE(Align(garment, targets, AlignOptions{}, context).ok());
  EXPECT_THAT(stages, ::testing::ElementsAre("fill", "stiff", "elastic", "untangle"));
  EXPECT_GT(error_mm[0], error_mm[1]);
  EXPECT_GT(error_mm[0], error_mm[2]);
}

TEST(Align, TellsObservedFromInferredVertices) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  std::vector<VertexTarget> targets =
      Measure(RolledAndMoved(garment.rest), 0.2, 3, [](int v) { return !InHiddenPatch(v); });
  for (VertexTarget& t : targets) t.sigma_mm = 0.2, t.views = 3 + t.vertex % 5;
  const auto result = Align(garment, targets, AlignOptions{});
  ASSERT_TRUE(result.ok());
  const RegisteredMesh& mesh = result->mesh;
  float worst_observed = 0, least_inferred = 1e9f;
  for (int v = 0; v < kRows * kCols; ++v) {
    if (InHiddenPatch(v)) {
      EXPECT_EQ(mesh.state[v], VertexState::kInferred);
      EXPECT_EQ(mesh.views[v], 0);
      least_inferred = std::min(least_inferred, mesh.sigma_mm[v]);
    } else {
      EXPECT_EQ(mesh.state[v], VertexState::kObserved);
      EXPECT_EQ(mesh.views[v], 3 + v % 5);
      worst_observed = std::max(worst_observed, mesh.sigma_mm[v]);
    }
  }
  EXPECT_LE(worst_observed, 0.3f);  // noise pulls a few further than they should be
  EXPECT_GT(least_inferred, worst_observed);
  // Known worse the further from what was seen.
  const int middle = kRows / 2 * kCols + kCols / 2;
  EXPECT_GT(mesh.sigma_mm[middle], mesh.sigma_mm[middle + 7]);
}

TEST(Align, NeverClaimsMoreCertaintyThanTheFloorAllows) {
  const Template garment = SheetTemplate(FlatSheet(20, 20));
  std::vector<VertexTarget> targets = Measure(garment.rest.vertices_mm, 0, 3);
  for (VertexTarget& t : targets) t.sigma_mm = 1e-4;
  AlignOptions options;
  options.detection.min_sigma_mm = 0.2;
  const auto result = Align(garment, targets, options);
  ASSERT_TRUE(result.ok());
  EXPECT_GT(result->mesh.sigma_mm[210], 0.1f);
  EXPECT_LE(result->mesh.sigma_mm[210], 0.2f);
}

TEST(Align, IsLessSureWhereTheClothIsPulledFromItsTarget) {
  const Template garment = SheetTemplate(FlatSheet(20, 20));
  std::vector<VertexTarget> targets = Measure(garment.rest.vertices_mm, 0, 3);
  for (VertexTarget& t : targets) t.sigma_mm = 0.2;
  targets[210].position_mm.z() += 2;
  const auto result = Align(garment, targets, AlignOptions{});
  ASSERT_TRUE(result.ok());
  const std::vector<float>& sigma_mm = result->mesh.sigma_mm;
  const double pulled_mm = (result->mesh.vertices_mm[210] - targets[210].position_mm).norm();
  EXPECT_GT(sigma_mm[210], 0.4 * pulled_mm);
  EXPECT_GT(sigma_mm[210], 2 * sigma_mm[25]);
}

TEST(Align, SetsOutliersAsideAndInfersTheirVertices) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto truth = RolledAndMoved(garment.rest);
  std::vector<VertexTarget> targets = Measure(truth, 0.3, 4);
  for (int v = 37; v < kRows * kCols; v += 97) targets[v].position_mm += Eigen::Vector3d(-18, 9, 25);
  targets[5].position_mm += Eigen::Vector3d(0, 3000, 0);
  const auto result = Align(garment, targets, AlignOptions{});
  ASSERT_TRUE(result.ok());
  EXPECT_LT(MaxDistance(result->mesh.vertices_mm, truth), 1.5);
  // All of them, and of the neighbours of the one 3 m off no more than those on its ring.
  const int outliers = (kRows * kCols - 37 + 96) / 97 + 1;
  EXPECT_GE(result->outliers, outliers);
  EXPECT_LE(result->outliers, outliers + 6);
  EXPECT_EQ(result->mesh.state[37], VertexState::kInferred);
  EXPECT_EQ(result->mesh.views[37], 0);
  EXPECT_EQ(result->mesh.state[38], VertexState::kObserved);
}

TEST(Align, TrustsPreciseTargetsMore) {
  const Template garment = SheetTemplate(FlatSheet(20, 20));
  std::vector<VertexTarget> targets = Measure(garment.rest.vertices_mm, 0, 5);
  for (VertexTarget& t : targets) t.sigma_mm = 0.5;
  targets[210].position_mm.z() += 1;
  const auto vague = Align(garment, targets, AlignOptions{});
  targets[210].sigma_mm = 0.1;
  const auto precise = Align(garment, targets, AlignOptions{});
  ASSERT_TRUE(vague.ok() && precise.ok());
  EXPECT_GT(precise->mesh.vertices_mm[210].z(), vague->mesh.vertices_mm[210].z() + 0.2);
}

TEST(Align, GivesTheSameBytesAtAnyThreadCount) {
  const tbb::global_control more_than_cores(tbb::global_control::max_allowed_parallelism, 4);
  const Template garment = SheetTemplate(FlatSheet(140, 100));  // several blocks; less than once around
  const auto truth = RolledAndMoved(garment.rest);
  std::vector<VertexTarget> targets = Measure(truth, 0.3, 6, [](int v) { return v % 7 != 0; });
  targets[99].position_mm.x() += 40;
  const auto run = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return Align(garment, targets, AlignOptions{}); });
  };
  const auto one = run(1);
  ASSERT_TRUE(one.ok()) << one.status();
  for (const int threads : {2, 4}) {
    const auto more = run(threads);
    ASSERT_TRUE(more.ok()) << more.status();
    ASSERT_EQ(one->mesh.vertices_mm.size(), more->mesh.vertices_mm.size());
    EXPECT_EQ(std::memcmp(one->mesh.vertices_mm.data(), more->mesh.vertices_mm.data(),
                          one->mesh.vertices_mm.size() * sizeof(Eigen::Vector3d)),
              0)
        << threads;
    EXPECT_EQ(one->mesh.sigma_mm, more->mesh.sigma_mm);
    EXPECT_EQ(one->outliers, more->outliers);
  }
}

// Two sheets, a third that nobody sees, triangles without area and vertices without faces.
TEST(Align, ToleratesComponentsIsolatedVerticesAndTrianglesWithoutArea) {
  TriangleMesh mesh = FlatSheet(15, 15);
  for (const double shift : {60.0, 120.0}) {
    const int base = static_cast<int>(mesh.vertices_mm.size());
    const TriangleMesh more = FlatSheet(8, 8);
    for (const Eigen::Vector3d& v : more.vertices_mm) {
      mesh.vertices_mm.push_back(v + Eigen::Vector3d(shift, 0, 0));
    }
    for (const Face& f : more.faces) mesh.faces.push_back({f[0] + base, f[1] + base, f[2] + base});
  }
  const int unseen_from = 225 + 64;
  mesh.vertices_mm[17] = mesh.vertices_mm[16];
  mesh.vertices_mm.emplace_back(-10, -10, 0);
  const Template garment = SheetTemplate(mesh);
  const auto truth = Mapped(mesh.vertices_mm, [](const auto& p) { return SomeMotion() * p; });
  // The fill of a border is not straight, and the paper takes the fill for a measurement and pushes it
  // inwards.
  for (const auto& [options, bound_mm] :
       {std::pair(testing::PaperAlignment(), 3.0), std::pair(AlignOptions{}, 0.02)}) {
    const auto result =
        Align(garment, Measure(truth, 0, 7, [&](int v) { return v < unseen_from && v % 3 != 0; }), options);
    ASSERT_TRUE(result.ok()) << result.status();
    // Cloth that nobody saw follows the template as a whole.
    EXPECT_LT(MaxDistance(result->mesh.vertices_mm, truth), bound_mm);
    EXPECT_GT(result->mesh.sigma_mm.back(), 10);
  }
}

TEST(Align, RefusesFramesWithTooFewTargets) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  std::vector<VertexTarget> targets = Measure(garment.rest.vertices_mm, 0, 8);
  targets.resize(9);  // needs 0.5 % of 2000
  const auto few = Align(garment, targets, AlignOptions{});
  EXPECT_EQ(few.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(few.status().message(),
              HasSubstr("9 of the template's 2000 vertices were measured, 10 are needed"));
  const auto none = Align(garment, {}, testing::PaperAlignment());
  EXPECT_EQ(none.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(none.status().message(), HasSubstr("0 of the template's 2000"));
}

TEST(Align, RefusesTargetsThatCannotPlaceTheTemplate) {
  const Template garment = SheetTemplate(FlatSheet(kRows, kCols));
  const auto line = Align(garment, Measure(garment.rest.vertices_mm, 0, 9, [](int v) { return v < kCols; }),
                          AlignOptions{});
  EXPECT_EQ(line.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(line.status().message(), HasSubstr("on a line"));
  const auto metres = Mapped(garment.rest.vertices_mm, [](const auto& p) { return p / 1000; });
  const auto scaled = Align(garment, Measure(metres, 0, 9), AlignOptions{});
  EXPECT_EQ(scaled.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(scaled.status().message(), HasSubstr("the cloud is in metres"));
}

TEST(Align, NamesTheTargetThatIsNoValidInput) {
  const Template garment = SheetTemplate(FlatSheet(4, 4));
  const std::vector<VertexTarget> good = Measure(garment.rest.vertices_mm, 0, 10);
  const auto message = [&](auto&& spoil) {
    std::vector<VertexTarget> targets = good;
    spoil(targets[3]);
    const auto result = Align(garment, targets, AlignOptions{});
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(result.status().message());
  };
  EXPECT_THAT(message([](VertexTarget& t) { t.vertex = 16; }), HasSubstr("target 3 (vertex 16)"));
  EXPECT_THAT(message([](VertexTarget& t) { t.vertex = 0; }), HasSubstr("has a target already"));
  EXPECT_THAT(message([](VertexTarget& t) { t.position_mm.y() = NAN; }), HasSubstr("position_mm"));
  EXPECT_THAT(message([](VertexTarget& t) { t.sigma_mm = -1; }), HasSubstr("sigma_mm"));
}

TEST(Align, NamesTheOptionThatIsWrong) {
  AlignOptions options;
  options.detection.filled_weight = 0;
  const auto result = Align(SheetTemplate(FlatSheet(4, 4)), {}, options);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(result.status().message(), HasSubstr("detection.filled_weight"));
}

}  // namespace
}  // namespace weft
