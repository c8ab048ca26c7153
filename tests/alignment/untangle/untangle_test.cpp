#include "alignment/untangle/untangle.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "alignment/untangle/self_intersection.h"
#include "tests/alignment/untangle/intersecting_sheets.h"

namespace weft {
namespace {

using testing::CrossedHems;
using testing::DentedLayers;
using testing::FlatSheet;
using testing::PinchedFold;
using testing::RoughLayers;
using testing::SleeveInTorso;
using testing::SomeMotion;

struct Outcome {
  UntangleReport report;
  TriangleMesh mesh;
};

Outcome Untangle(TriangleMesh mesh, const std::vector<float>& sigma_mm = {}) {
  const auto report = RemoveSelfIntersections(mesh.faces, sigma_mm, {}, &mesh.vertices_mm);
  EXPECT_TRUE(report.ok()) << report.status();
  return {report.value_or(UntangleReport{}), std::move(mesh)};
}

// As a file would hold it.
std::vector<Eigen::Vector3d> Stored(std::vector<Eigen::Vector3d> vertices_mm) {
  for (Eigen::Vector3d& v : vertices_mm) v = v.cast<float>().cast<double>();
  return vertices_mm;
}

void ExpectClean(const Outcome& outcome) {
  EXPECT_EQ(outcome.report.pairs_after, 0);
  EXPECT_EQ(outcome.report.vertex_pairs_after, 0);
  EXPECT_TRUE(FindSelfIntersections(outcome.mesh.vertices_mm, outcome.mesh.faces).empty());
  EXPECT_TRUE(FindIntersectingPairs(Stored(outcome.mesh.vertices_mm), outcome.mesh.faces).empty());
}

int Moved(const std::vector<Eigen::Vector3d>& before, const std::vector<Eigen::Vector3d>& after) {
  int moved = 0;
  for (size_t v = 0; v < before.size(); ++v) moved += before[v] != after[v];
  return moved;
}

TEST(RemoveSelfIntersections, LeavesACleanMeshAsItIs) {
  TriangleMesh mesh = FlatSheet(30, 30);
  for (Eigen::Vector3d& v : mesh.vertices_mm) v = SomeMotion() * testing::Rolled(v, 20);
  const Outcome outcome = Untangle(mesh);
  EXPECT_EQ(outcome.report.pairs_before, 0);
  EXPECT_EQ(outcome.report.moved_vertices, 0);
  EXPECT_EQ(0, std::memcmp(mesh.vertices_mm.data(), outcome.mesh.vertices_mm.data(),
                           mesh.vertices_mm.size() * sizeof(Eigen::Vector3d)));
}

TEST(RemoveSelfIntersections, PartsLayersThatPassThroughEachOther) {
  const TriangleMesh mesh = DentedLayers(60, 4, 18);
  const Outcome outcome = Untangle(mesh);
  EXPECT_GT(outcome.report.pairs_before, 50);
  ExpectClean(outcome);
  // Half the way each, and no vertex far from the dent moves.
  EXPECT_LT(outcome.report.max_move_mm, 3);
  EXPECT_EQ(outcome.report.moved_vertices, Moved(mesh.vertices_mm, outcome.mesh.vertices_mm));
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    const Eigen::Vector3d& p = mesh.vertices_mm[v];
    if (std::hypot(p.x() - 80, p.y() - 80) > 60) {
      ASSERT_EQ(p, outcome.mesh.vertices_mm[v]) << v;
    }
  }
}

TEST(RemoveSelfIntersections, MovesWhatIsKnownLeast) {
  const TriangleMesh mesh = DentedLayers(60, 4, 18);
  const size_t layer = mesh.vertices_mm.size() / 2;
  std::vector<float> sigma_mm(mesh.vertices_mm.size(), 0.2f);
  std::fill(sigma_mm.begin() + static_cast<int>(layer), sigma_mm.end(), 3.f);
  const Outcome outcome = Untangle(mesh, sigma_mm);
  ExpectClean(outcome);
  double known = 0, unknown = 0;
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    double& largest = v < layer ? known : unknown;
    largest = std::max(largest, (outcome.mesh.vertices_mm[v] - mesh.vertices_mm[v]).norm());
  }
  EXPECT_LT(known, 0.4);
  EXPECT_GT(unknown, 3);
}

TEST(RemoveSelfIntersections, OpensAPinchedFold) {
  const Outcome outcome = Untangle(PinchedFold(50, 1));
  EXPECT_GT(outcome.report.pairs_before, 20);
  ExpectClean(outcome);
  EXPECT_LT(outcome.report.max_move_mm, 8);
}

TEST(RemoveSelfIntersections, PullsASleeveOutOfTheTorso) {
  const Outcome outcome = Untangle(SleeveInTorso(6));
  EXPECT_GT(outcome.report.pairs_before, 50);
  ExpectClean(outcome);
  EXPECT_LT(outcome.report.max_move_mm, 5);
}

TEST(RemoveSelfIntersections, PartsHemsThatCutIntoEachOther) {
  const Outcome outcome = Untangle(CrossedHems(24));
  EXPECT_GT(outcome.report.pairs_before, 4);
  ExpectClean(outcome);
}

TEST(RemoveSelfIntersections, PartsLayersInACommonPlane) {
  TriangleMesh other = FlatSheet(6, 6);
  for (Eigen::Vector3d& v : other.vertices_mm) v += Eigen::Vector3d(9.1, 9.4, 0);
  ExpectClean(Untangle(testing::Joined(FlatSheet(16, 16), other)));
}

TEST(RemoveSelfIntersections, PartsFacesThatMeetAroundAVertex) {
  const Outcome outcome = Untangle(testing::FacesThroughEachOtherAtAVertex());
  EXPECT_EQ(outcome.report.pairs_before, 0);
  EXPECT_EQ(outcome.report.vertex_pairs_before, 1);
  ExpectClean(outcome);
}

class RandomTangles : public ::testing::TestWithParam<uint32_t> {};

TEST_P(RandomTangles, EndCleanOrAreCounted) {
  TriangleMesh mesh = RoughLayers(40, 2.0, GetParam());
  for (Eigen::Vector3d& v : mesh.vertices_mm) v = SomeMotion() * v;
  const Outcome outcome = Untangle(mesh);
  EXPECT_GT(outcome.report.pairs_before, 100);
  const IntersectingPairs left = FindIntersectingPairs(outcome.mesh.vertices_mm, outcome.mesh.faces);
  EXPECT_EQ(outcome.report.pairs_after, static_cast<int>(left.apart.size()));
  EXPECT_EQ(outcome.report.vertex_pairs_after, static_cast<int>(left.at_vertex.size()));
  ExpectClean(outcome);
}
INSTANTIATE_TEST_SUITE_P(Seeds, RandomTangles, ::testing::Range(1u, 7u));

// Noise that throws single vertices through their neighbours, all over a tube.
TEST(RemoveSelfIntersections, CleansUpAfterNoise) {
  TriangleMesh mesh = testing::Tube(70, 30, 30);
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, 2);
  for (size_t v = 0; v < mesh.vertices_mm.size(); v += 5) {
    mesh.vertices_mm[v] += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  const Outcome outcome = Untangle(mesh);
  EXPECT_GT(outcome.report.pairs_before + outcome.report.vertex_pairs_before, 20);
  ExpectClean(outcome);
}

TEST(RemoveSelfIntersections, TakesFacesWithoutArea) {
  TriangleMesh mesh = DentedLayers(40, 3, 12);
  for (int v = 805; v < 815; v += 2) mesh.vertices_mm[v] = mesh.vertices_mm[v + 1];
  ExpectClean(Untangle(mesh));
}

// The projective plane has no place in space without intersections.
TEST(RemoveSelfIntersections, CountsWhatCanNotBeParted) {
  TriangleMesh mesh{{{0, 0, 0}, {9, 1, 0}, {8, 9, 1}, {1, 8, 0}, {4, 5, 9}, {5, 3, 4}},
                    {{0, 1, 4},
                     {0, 1, 5},
                     {0, 2, 3},
                     {0, 2, 5},
                     {0, 3, 4},
                     {1, 2, 3},
                     {1, 2, 4},
                     {1, 3, 5},
                     {2, 4, 5},
                     {3, 4, 5}}};
  const Outcome outcome = Untangle(mesh);
  const IntersectingPairs left = FindIntersectingPairs(outcome.mesh.vertices_mm, outcome.mesh.faces);
  EXPECT_FALSE(left.empty());
  EXPECT_EQ(outcome.report.pairs_after, static_cast<int>(left.apart.size()));
  EXPECT_EQ(outcome.report.vertex_pairs_after, static_cast<int>(left.at_vertex.size()));
}

TEST(RemoveSelfIntersections, LeavesAllWithoutRounds) {
  UntangleOptions options;
  options.max_rounds = 0;
  TriangleMesh mesh = DentedLayers(30, 4, 12);
  const TriangleMesh before = mesh;
  const auto report = RemoveSelfIntersections(mesh.faces, {}, options, &mesh.vertices_mm);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->pairs_after, report->pairs_before);
  EXPECT_EQ(mesh.vertices_mm, before.vertices_mm);
}

RegisteredMesh Registered(const TriangleMesh& mesh, const std::function<bool(size_t)>& is_observed) {
  RegisteredMesh registered{.vertices_mm = mesh.vertices_mm, .state = {}, .sigma_mm = {}, .views = {}};
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    registered.state.push_back(is_observed(v) ? VertexState::kObserved : VertexState::kInferred);
    registered.sigma_mm.push_back(is_observed(v) ? 0.1f : 3.f);
    registered.views.push_back(is_observed(v) ? 5 : 0);
  }
  return registered;
}

// Everything still called observed is within three sigma of where it was; the others say how far they went.
void ExpectHonest(const TriangleMesh& before, const RegisteredMesh& mesh, const UntangleReport& report,
                  const std::function<bool(size_t)>& was_observed) {
  int demoted = 0;
  for (size_t v = 0; v < before.vertices_mm.size(); ++v) {
    const double move_mm = (mesh.vertices_mm[v] - before.vertices_mm[v]).norm();
    if (mesh.state[v] == VertexState::kObserved) {
      ASSERT_TRUE(was_observed(v)) << v;
      ASSERT_LE(move_mm, 0.3) << v;
    } else if (was_observed(v)) {
      ++demoted;
      EXPECT_EQ(mesh.views[v], 0);
      EXPECT_NEAR(mesh.sigma_mm[v], std::hypot(0.1, move_mm), 1e-4);
    }
  }
  EXPECT_EQ(report.demoted_vertices, demoted);
}

TEST(RemoveSelfIntersections, InferredClothMakesWayForObserved) {
  const TriangleMesh mesh = DentedLayers(60, 6, 18);
  const size_t layer = mesh.vertices_mm.size() / 2;
  // Whichever layer was observed.
  for (const bool below : {true, false}) {
    const auto is_observed = [&](size_t v) { return (v < layer) == below; };
    RegisteredMesh registered = Registered(mesh, is_observed);
    const auto report = RemoveSelfIntersections(mesh.faces, {}, &registered);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_GT(report->pairs_before, 50);
    ExpectClean({*report, {registered.vertices_mm, mesh.faces}});
    EXPECT_EQ(report->demoted_vertices, 0);
    ExpectHonest(mesh, registered, *report, is_observed);
  }
}

// One side of the fold was observed, the other, which passes through it, was not.
TEST(RemoveSelfIntersections, HiddenSideOfAPinchedFoldMakesWay) {
  const TriangleMesh mesh = PinchedFold(50, 1);
  const auto is_observed = [&](size_t v) { return v % 50 < 25; };
  RegisteredMesh registered = Registered(mesh, is_observed);
  const auto report = RemoveSelfIntersections(mesh.faces, {}, &registered);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_GT(report->pairs_before, 20);
  ExpectClean({*report, {registered.vertices_mm, mesh.faces}});
  EXPECT_LE(report->demoted_vertices, 10);  // of 1250, along the ridge
  ExpectHonest(mesh, registered, *report, is_observed);
}

TEST(RemoveSelfIntersections, ObservedVerticesThatContradictEachOtherAreDemoted) {
  const TriangleMesh mesh = DentedLayers(60, 4, 18);
  const auto is_observed = [](size_t) { return true; };
  RegisteredMesh registered = Registered(mesh, is_observed);
  const auto report = RemoveSelfIntersections(mesh.faces, {}, &registered);
  ASSERT_TRUE(report.ok()) << report.status();
  ExpectClean({*report, {registered.vertices_mm, mesh.faces}});
  EXPECT_GT(report->demoted_vertices, 0);
  ExpectHonest(mesh, registered, *report, is_observed);
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    const Eigen::Vector3d& p = mesh.vertices_mm[v];
    if (std::hypot(p.x() - 80, p.y() - 80) > 60) {
      ASSERT_EQ(registered.state[v], VertexState::kObserved) << v;
    }
  }
}

// Two layers a millimetre apart, of which strips were observed; what is hidden between them strays through
// both.
TEST(RemoveSelfIntersections, ObservedStripsStayWhereHiddenClothStrays) {
  TriangleMesh mesh = RoughLayers(60, 0, 1);
  const size_t layer = mesh.vertices_mm.size() / 2;
  const auto is_observed = [&](size_t v) { return v % 60 / 3 % 3 == (v < layer ? 0 : 1); };
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    Eigen::Vector3d& p = mesh.vertices_mm[v];
    const double wave = std::sin(p.x() / 9) * std::cos(p.y() / 13);
    p.z() += 4 * wave + (is_observed(v) ? 0 : 5 * std::sin(p.y() / 7 + (v < layer ? 0 : 2)));
  }
  RegisteredMesh registered = Registered(mesh, is_observed);
  const auto report = RemoveSelfIntersections(mesh.faces, {}, &registered);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_GT(report->pairs_before, 500);
  ExpectClean({*report, {registered.vertices_mm, mesh.faces}});
  EXPECT_EQ(report->demoted_vertices, 0);
  ExpectHonest(mesh, registered, *report, is_observed);
}

TEST(RemoveSelfIntersections, ContactWithinSigmaDemotesNobody) {
  const TriangleMesh mesh = DentedLayers(60, 0.2, 18);
  const auto is_observed = [](size_t) { return true; };
  RegisteredMesh registered = Registered(mesh, is_observed);
  const auto report = RemoveSelfIntersections(mesh.faces, {}, &registered);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_GT(report->pairs_before, 10);
  ExpectClean({*report, {registered.vertices_mm, mesh.faces}});
  EXPECT_EQ(report->demoted_vertices, 0);
  ExpectHonest(mesh, registered, *report, is_observed);
}

TEST(RemoveSelfIntersections, SameAtAnyThreadCount) {
  const TriangleMesh mesh = DentedLayers(60, 4, 18);
  const auto run = [&](int threads) {
    return tbb::task_arena(threads).execute([&] { return Untangle(mesh).mesh.vertices_mm; });
  };
  EXPECT_EQ(run(1), run(2));
}

TEST(RemoveSelfIntersections, NamesInputThatIsNone) {
  TriangleMesh mesh = FlatSheet(4, 4);
  const auto message = [&](const std::vector<Face>& faces, const std::vector<float>& sigma_mm) {
    const auto report = RemoveSelfIntersections(faces, sigma_mm, {}, &mesh.vertices_mm);
    EXPECT_EQ(report.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(report.status().message());
  };
  EXPECT_EQ(message({{0, 1, 16}}, {}), "face 0: needs three different vertices of 0 to 15");
  EXPECT_EQ(message({{0, 1, 1}}, {}), "face 0: needs three different vertices of 0 to 15");
  EXPECT_EQ(message(mesh.faces, {1, 2}), "sigma_mm: 2 values for 16 vertices; give one each, or none");
  EXPECT_EQ(message(mesh.faces, std::vector<float>(16, 0)), "vertex 0: sigma_mm must be positive");
  mesh.vertices_mm[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message(mesh.faces, {}), "vertex 3: its position is not finite");
}

TEST(RemoveSelfIntersections, NamesOptionsThatAreNone) {
  TriangleMesh mesh = FlatSheet(4, 4);
  UntangleOptions options;
  options.back.gap_mm = 0;
  const auto report = RemoveSelfIntersections(mesh.faces, {}, options, &mesh.vertices_mm);
  EXPECT_EQ(report.status().message(), "untangle.back.gap_mm must be positive");
}

TEST(RemoveSelfIntersections, TakesAMeshWithoutFaces) {
  std::vector<Eigen::Vector3d> none;
  EXPECT_TRUE(RemoveSelfIntersections({}, {}, {}, &none).ok());
}

}  // namespace
}  // namespace weft
