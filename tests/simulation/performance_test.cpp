#include "simulation/performance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "alignment/untangle/self_intersection.h"
#include "figure/motion_generator.h"

namespace weft {
namespace {

PerformanceOptions SmallPerformance() {
  PerformanceOptions options;
  options.garment = GarmentKind::kTube;
  options.rows = 12, options.cols = 24, options.cell_mm = 4;
  options.frames = 3, options.settle_s = 0.1;
  return options;
}

TEST(Performance, HandsOutItsFramesInOrderAndThenSaysThatTheyAreTaken) {
  auto performance = Performance::Start(SmallPerformance());
  ASSERT_TRUE(performance.ok()) << performance.status();
  EXPECT_EQ(performance->garment().board_rows, 12);
  EXPECT_EQ(performance->garment().board_cols, 24);
  for (int i = 0; i < 3; ++i) {
    const auto frame = performance->Next();
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_NEAR(frame->time_ns, i * 1e9 / 30, 1);
    EXPECT_EQ(frame->vertices_mm.size(), performance->garment().rest.vertices_mm.size());
    EXPECT_EQ(frame->velocities_mm_s.size(), frame->vertices_mm.size());
  }
  EXPECT_EQ(performance->Next().status().code(), absl::StatusCode::kOutOfRange);
}

TEST(Performance, OptionsOutOfRangeAreNamed) {
  PerformanceOptions options = SmallPerformance();
  options.fps = 0;
  const auto performance = Performance::Start(options);
  EXPECT_EQ(performance.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(performance.status().message().find("fps"), std::string::npos);
}

// How often the closed surfaces wind around a point: 0 outside of all of them.
double WindingNumber(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& x,
                     const std::vector<Face>& faces) {
  double sum = 0;
  for (const Face& f : faces) {
    const Eigen::Vector3d a = x[f[0]] - p, b = x[f[1]] - p, c = x[f[2]] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

// A T-shirt of 2500 cells.
PerformanceOptions SmallTShirt() {
  PerformanceOptions options;
  options.garment = GarmentKind::kTShirt;
  options.cell_mm = 20;
  options.frames = 3, options.settle_s = 0.1;
  return options;
}

TEST(Performance, DressesAPersonInATShirtWithoutPassingThroughItOrItself) {
  auto performance = Performance::Start(SmallTShirt());
  ASSERT_TRUE(performance.ok()) << performance.status();
  const Garment& garment = performance->garment();
  EXPECT_TRUE(FindSelfIntersections(garment.rest.vertices_mm, garment.rest.faces).empty());
  for (int i = 0; i < 3; ++i) {
    const auto frame = performance->Next();
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_EQ(frame->vertices_mm.size(), garment.cell_of_vertex.size());
    EXPECT_FALSE(performance->body_faces().empty());
    EXPECT_TRUE(FindSelfIntersections(frame->vertices_mm, garment.rest.faces).empty());
    for (size_t v = 0; v < frame->vertices_mm.size(); v += 20) {
      const double winding =
          WindingNumber(frame->vertices_mm[v], frame->body_vertices_mm, performance->body_faces());
      EXPECT_LT(winding, 0.5) << "vertex " << v << " is inside the body";
    }
  }
}

// Length of every side of a face relative to the flat pattern, in order of size.
std::vector<double> StretchesOf(const Garment& garment, const std::vector<Eigen::Vector3d>& x) {
  std::vector<double> out;
  for (size_t f = 0; f < garment.rest.faces.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const Face& face = garment.rest.faces[f];
      const double flat_mm =
          garment.cell_mm * (garment.print.of_face[f][k] - garment.print.of_face[f][next]).norm();
      out.push_back((x[face[k]] - x[face[next]]).norm() / flat_mm);
    }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(Performance, AHandThatPullsStretchesClothNoFurtherThanClothBears) {
  PerformanceOptions options = SmallTShirt();
  options.motion = PerformanceMotion::kPinch;
  options.fps = 10, options.frames = 27;
  auto performance = Performance::Start(options);
  ASSERT_TRUE(performance.ok()) << performance.status();
  double pulled_mm = 0;
  std::vector<Eigen::Vector3d> first;
  for (int i = 0; i < options.frames; ++i) {
    const auto frame = performance->Next();
    ASSERT_TRUE(frame.ok()) << frame.status();
    const std::vector<double> stretch = StretchesOf(performance->garment(), frame->vertices_mm);
    EXPECT_LT(stretch.back(), 1.5) << "frame " << i;
    EXPECT_LT(stretch[stretch.size() * 999 / 1000], 1.2) << "frame " << i;
    EXPECT_TRUE(FindSelfIntersections(frame->vertices_mm, performance->garment().rest.faces).empty());
    if (i == 0) first = frame->vertices_mm;
    for (size_t v = 0; v < first.size(); ++v)
      pulled_mm = std::max(pulled_mm, first[v].z() - frame->vertices_mm[v].z());
  }
  EXPECT_GT(pulled_mm, 30) << "the hand got hold of nothing";
}

// Cells of 20 mm are thick for the 12 mm that arms leave in armpits: pinched cloth must come along.
TEST(Performance, ClothThatArmsPinchAgainstTheTrunkIsNotTorn) {
  PerformanceOptions options = SmallTShirt();
  const auto walk = MakeMotion({MotionKind::kWalk, 4, 60, 104});
  ASSERT_TRUE(walk.ok()) << walk.status();
  options.clip = std::make_shared<const Motion>(*walk);
  options.fps = 15, options.frames = 27;
  auto performance = Performance::Start(options);
  ASSERT_TRUE(performance.ok()) << performance.status();
  for (int i = 0; i < options.frames; ++i) {
    const auto frame = performance->Next();
    ASSERT_TRUE(frame.ok()) << frame.status();
    const std::vector<double> stretch = StretchesOf(performance->garment(), frame->vertices_mm);
    EXPECT_LT(stretch[stretch.size() * 995 / 1000], 1.2) << "frame " << i;
    EXPECT_TRUE(FindSelfIntersections(frame->vertices_mm, performance->garment().rest.faces).empty());
  }
}

TEST(Performance, SkirtFollowsTheLegsWithoutPassingThroughItself) {
  PerformanceOptions options = SmallTShirt();
  options.garment = GarmentKind::kSkirt, options.motion = PerformanceMotion::kJogging;
  options.fps = 10;
  auto performance = Performance::Start(options);
  ASSERT_TRUE(performance.ok()) << performance.status();
  for (int i = 0; i < 3; ++i) {
    const auto frame = performance->Next();
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_TRUE(FindSelfIntersections(frame->vertices_mm, performance->garment().rest.faces).empty());
  }
}

}  // namespace
}  // namespace weft
