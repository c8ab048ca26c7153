#include "alignment/start_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using ::testing::AllOf;
using testing::FlatSheet;
using ::testing::HasSubstr;
using testing::Mapped;
using testing::Rolled;

constexpr int kSheetSide = 20;

// Cloth as it hangs: bent, and lengths as at rest.
TriangleMesh Bent() {
  TriangleMesh mesh = FlatSheet(kSheetSide, kSheetSide);
  mesh.vertices_mm = Mapped(mesh.vertices_mm, [](const Eigen::Vector3d& p) { return Rolled(p, 20); });
  return mesh;
}

std::string StartErrorOf(const TriangleMesh& start) {
  const absl::Status status = CheckStartMesh(start, FlatSheet(kSheetSide, kSheetSide));
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(CheckStartMesh, TakesMeshesOfTheTemplate) {
  const TriangleMesh rest = FlatSheet(kSheetSide, kSheetSide);
  TriangleMesh start = Bent();
  EXPECT_TRUE(CheckStartMesh(start, rest).ok());
  // As other programs write them: faces in another order, from another corner, turned, some lost.
  std::reverse(start.faces.begin(), start.faces.end());
  for (Face& face : start.faces) face = {face[2], face[1], face[0]};
  start.faces.resize(start.faces.size() / 2);
  EXPECT_TRUE(CheckStartMesh(start, rest).ok());
}

TEST(CheckStartMesh, RefusesAnotherOrder) {
  TriangleMesh start = Bent();
  std::swap(start.vertices_mm[5], start.vertices_mm[300]);
  EXPECT_THAT(StartErrorOf(start), HasSubstr("vertex 5 is far from all its neighbours"));
  for (Face& face : start.faces)
    for (int& v : face) v = v == 5 ? 300 : v == 300 ? 5 : v;
  EXPECT_THAT(StartErrorOf(start), AllOf(HasSubstr("no face of the template"), HasSubstr("renumber")));
  TriangleMesh shuffled = Bent();
  for (size_t v = 0; v < shuffled.vertices_mm.size(); ++v)
    shuffled.vertices_mm[v] = Bent().vertices_mm[v * 7 % shuffled.vertices_mm.size()];
  EXPECT_THAT(StartErrorOf(shuffled), HasSubstr("another order"));
}

// Neighbours stay neighbours within such a block.
TEST(CheckStartMesh, RefusesABlockInAnotherOrder) {
  TriangleMesh start = Bent();
  std::reverse(start.vertices_mm.begin(), start.vertices_mm.begin() + kSheetSide);
  EXPECT_THAT(StartErrorOf(start), HasSubstr("are some of its vertices in another order?"));
}

TEST(CheckStartMesh, RefusesAnotherSize) {
  TriangleMesh start = Bent();
  for (Eigen::Vector3d& v : start.vertices_mm) v *= 1.3;
  EXPECT_THAT(StartErrorOf(start), HasSubstr("times as long as the template's"));
}

TEST(CheckStartMesh, RefusesAnotherUnit) {
  TriangleMesh start = Bent();
  for (Eigen::Vector3d& v : start.vertices_mm) v /= 1000;
  EXPECT_THAT(StartErrorOf(start), HasSubstr("it is in metres, give it in mm"));
}

std::vector<VertexTarget> TargetsOf(const TriangleMesh& mesh) {
  std::vector<VertexTarget> targets;
  for (size_t v = 0; v < mesh.vertices_mm.size(); v += 2)
    targets.push_back({.vertex = static_cast<int>(v), .position_mm = mesh.vertices_mm[v]});
  return targets;
}

TEST(PlaceStart, LeavesWhatLiesAsTheTargetsDo) {
  const TriangleMesh now = Bent();
  std::vector<Eigen::Vector3d> before = Mapped(now.vertices_mm, [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()) * p + Eigen::Vector3d(9, -4, 30));
  });
  const auto placed = PlaceStart(before, TargetsOf(now));
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_EQ(placed->turned_deg, 0);
  EXPECT_EQ(placed->vertices_mm, before);
}

TEST(PlaceStart, TurnsBackWhatIsTurned) {
  const TriangleMesh now = Bent();
  const std::vector<Eigen::Vector3d> turned = Mapped(now.vertices_mm, [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()) * p +
                           Eigen::Vector3d(100, 0, 0));
  });
  const auto placed = PlaceStart(turned, TargetsOf(now));
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_NEAR(placed->turned_deg, 90, 1e-6);
  for (size_t v = 0; v < turned.size(); ++v)
    EXPECT_NEAR((placed->vertices_mm[v] - now.vertices_mm[v]).norm(), 0, 1e-9);
}

TEST(PlaceStart, RefusesAMirrorImage) {
  const TriangleMesh now = Bent();
  const std::vector<Eigen::Vector3d> mirrored =
      Mapped(now.vertices_mm, [](const Eigen::Vector3d& p) { return Eigen::Vector3d(p.x(), p.y(), -p.z()); });
  const auto placed = PlaceStart(mirrored, TargetsOf(now));
  EXPECT_EQ(placed.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(placed.status().message(), HasSubstr("mirror image"));
}

}  // namespace
}  // namespace weft
