#include "simulation/folded_cloth.h"
#include "alignment/vertex_normals.h"
#include "base/median.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "alignment/untangle/self_intersection.h"
#include "simulation/folded_motion.h"
#include "simulation/take_presets.h"

namespace weft {
namespace {

using Eigen::Vector3d;

PerformanceOptions Small(GarmentKind kind, int frames) {
  PerformanceOptions options;
  options.garment = kind;
  options.rows = 14, options.cols = kind == GarmentKind::kPleatedSkirt ? 168 : 60, options.cell_mm = 4;
  options.frames = frames, options.settle_s = 0.4;
  options.handles.compression = kind == GarmentKind::kGatheredSkirt ? 0.5 : 0.05;
  return options;
}

std::vector<std::vector<Vector3d>> Frames(const PerformanceOptions& options) {
  auto performance = Performance::Start(options);
  EXPECT_TRUE(performance.ok()) << performance.status();
  std::vector<std::vector<Vector3d>> out;
  for (int i = 0; i < options.frames; ++i) out.push_back(performance->Next()->vertices_mm);
  return out;
}

// Relative change of the lengths of the edges along rows and columns, ascending.
std::vector<double> Strains(const Cloth& cloth, const std::vector<Vector3d>& x) {
  std::vector<double> out;
  for (size_t f = 0; f < cloth.rest.faces.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const Eigen::Vector2d along = cloth.print.of_face[f][j] - cloth.print.of_face[f][i];
      if (along.x() != 0 && along.y() != 0) continue;
      const double length = (x[cloth.rest.faces[f][i]] - x[cloth.rest.faces[f][j]]).norm();
      out.push_back(std::abs(length / (cloth.options.cell_mm * along.norm()) - 1));
    }
  std::sort(out.begin(), out.end());
  return out;
}

class FoldedKinds : public testing::TestWithParam<GarmentKind> {};

TEST_P(FoldedKinds, MoveWithoutPassingThroughThemselvesAndHardlyStretch) {
  const PerformanceOptions options = Small(GetParam(), 3);
  auto performance = Performance::Start(options);
  ASSERT_TRUE(performance.ok()) << performance.status();
  const Garment& garment = performance->garment();
  std::vector<std::vector<Vector3d>> frames;
  for (int i = 0; i < options.frames; ++i) {
    const PerformanceFrame frame = *performance->Next();
    for (const Vector3d& p : frame.vertices_mm) ASSERT_TRUE(p.allFinite());
    EXPECT_TRUE(FindSelfIntersections(frame.vertices_mm, garment.rest.faces).empty());
    EXPECT_EQ(frame.body_vertices_mm.empty(), performance->body_faces().empty());
    frames.push_back(frame.vertices_mm);
  }
  std::vector<double> lengths;
  for (const Face& f : garment.rest.faces) {
    const double rest = (garment.rest.vertices_mm[f[0]] - garment.rest.vertices_mm[f[1]]).norm();
    if (rest > 1) lengths.push_back(std::abs((frames[0][f[0]] - frames[0][f[1]]).norm() / rest - 1));
  }
  EXPECT_LT(Median(lengths), 0.04);
  double moved = 0;
  for (size_t v = 0; v < frames[0].size(); ++v) moved = std::max(moved, (frames[2][v] - frames[0][v]).norm());
  EXPECT_GT(moved, 2) << "the cloth stands still";
}

TEST_P(FoldedKinds, FollowFromTheSeedAtAnyNumberOfThreads) {
  PerformanceOptions options = Small(GetParam(), 1);
  options.settle_s = 0.1;
  std::vector<std::vector<Vector3d>> one, three;
  tbb::task_arena(1).execute([&] { one = Frames(options); });
  tbb::task_arena(3).execute([&] { three = Frames(options); });
  EXPECT_EQ(one, three);
  options.seed = 2;
  EXPECT_NE(one, Frames(options));
}

INSTANTIATE_TEST_SUITE_P(All, FoldedKinds,
                         testing::Values(GarmentKind::kPleatedSkirt, GarmentKind::kGatheredSkirt,
                                         GarmentKind::kCurlingSheet),
                         [](const auto& kind) {
                           std::string name(NameOf(kind.param));
                           std::erase(name, '-');
                           return name;
                         });

TEST(PleatedSkirt, BeginsFoldedButUnstretchedWithItsCreases) {
  const FoldedCloth skirt = *MakePleatedSkirt(Small(GarmentKind::kPleatedSkirt, 1));
  EXPECT_TRUE(FindSelfIntersections(skirt.start_mm, skirt.cloth.rest.faces).empty());
  const std::vector<double> strains = Strains(skirt.cloth, skirt.start_mm);
  EXPECT_LT(strains[strains.size() / 2], 0.03);
  // Every crease stands out or in; as many of one kind as of the other, in narrow strips.
  int outer = 0, inner = 0;
  for (const Crease& c : skirt.creases) (c.angle_rad > 0 ? outer : inner) += 1;
  EXPECT_EQ(outer, inner);
  const int per_row = outer / (skirt.cloth.grid_rows - 1);
  EXPECT_EQ(per_row, 18) << "of 9 or 10 cells";
  // The waist is shorter than the cloth by what is hidden in the pleats.
  double around = 0;
  for (const Vector3d& p : skirt.held_to_mm) around = std::max(around, std::hypot(p.x(), p.z()));
  EXPECT_LT(around, 0.6 * 168 * 4 / (2 * std::numbers::pi));
}

TEST(PleatedSkirt, TooFewColumnsAreNamed) {
  PerformanceOptions options = Small(GarmentKind::kPleatedSkirt, 1);
  options.cols = 100;
  const auto skirt = MakePleatedSkirt(options);
  EXPECT_EQ(skirt.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(skirt.status().message().find("cols is 100"), std::string::npos);
}

TEST(GatheredSkirt, IsDrawnTogetherOnUnevenStitches) {
  const PerformanceOptions options = Small(GarmentKind::kGatheredSkirt, 1);
  const FoldedCloth skirt = *MakeGatheredSkirt(options);
  const double full_mm = 60 * 4 / (2 * std::numbers::pi);
  std::set<double> gaps;
  double before = -1;
  for (size_t k = 0; k < skirt.held.size() / 2; ++k) {
    EXPECT_NEAR(std::hypot(skirt.held_from_mm[k].x(), skirt.held_from_mm[k].z()), full_mm, 1);
    EXPECT_NEAR(std::hypot(skirt.held_to_mm[k].x(), skirt.held_to_mm[k].z()), 0.5 * full_mm, 1.3);
    const Vector3d& p = skirt.cloth.rest.vertices_mm[skirt.held[k]];
    const double at = std::atan2(p.x(), -p.z());
    if (k > 0) gaps.insert(std::round(100 * (at - before)));
    before = at;
  }
  EXPECT_GT(gaps.size(), 2u) << "stitches are even";
}

// Without the hems' own curvature the strips would hang flat.
TEST(CurlingSheet, HemsRollAndTheirEdgesPointElsewhere) {
  PerformanceOptions options = Small(GarmentKind::kCurlingSheet, 1);
  options.rows = 30, options.settle_s = 0.6;
  const FoldedCloth sheet = *MakeCurlingSheet(options);
  ASSERT_FALSE(sheet.cloth.slit_edges.empty());
  const std::vector<Vector3d> x = Frames(options)[0];
  const std::vector<Vector3d> normals = VertexNormals(x, sheet.cloth.rest.faces);
  std::vector<double> turn_deg;
  for (const auto& edges : sheet.cloth.slit_edges)
    for (size_t k = edges[1].size() / 3; k < edges[1].size(); ++k) {
      // The left edge of a strip against the middle of that strip, four cells further.
      const int line = options.rows - static_cast<int>(edges[1].size()) + static_cast<int>(k) + 1;
      const int slit = sheet.cloth.options.slits[&edges - sheet.cloth.slit_edges.data()];
      const int middle = sheet.cloth.vertex_at(std::min(line, options.rows), slit + 5);
      turn_deg.push_back(std::acos(std::clamp(normals[edges[1][k]].dot(normals[middle]), -1.0, 1.0)) * 180 /
                         std::numbers::pi);
    }
  EXPECT_GT(Median(turn_deg), 60);
}

// The presets' cameras, before less cloth than the presets'.
class FoldPresets : public testing::TestWithParam<const char*> {};

TEST_P(FoldPresets, ShowMostCellsAtThreeToFivePixelsAndSmearSome) {
  SyntheticTakeOptions options = *SyntheticPreset(GetParam(), 1);
  EXPECT_EQ(options.shutter.exposure_ms, 5);
  options.performance.frames = 2, options.performance.settle_s = 0.2;
  options.performance.rows = 20;
  if (options.performance.garment != GarmentKind::kPleatedSkirt) options.performance.cols = 96;
  options.look.light.rays = 4;
  SyntheticTake take = *SyntheticTake::Make(options);
  ASSERT_TRUE(take.Skip().ok());
  const TakeFrame frame = *take.Next();
  const PrintLocator locator(frame.scene.print());
  int scoreable = 0, in_range = 0, smeared = 0;
  for (const int camera : {0, 3, 6}) {
    const CameraModel& model = take.rig().cameras[camera];
    const ViewTruth truth = FindViewTruth(frame.scene.mesh(), locator, frame.scene.rays(), model);
    for (const NodeTruth& node : truth.nodes) {
      if (!node.scoreable || node.node.kind != NodeKind::kCenter || node.vertex < 0) continue;
      ++scoreable;
      in_range += node.pitch_px >= 3 && node.pitch_px < 5;
      const Vector3d& way_mm = frame.scene.paths_mm()[node.vertex];
      const Vector3d& at_mm = frame.scene.mesh().vertices_mm[node.vertex];
      smeared += (*model.Project(at_mm + way_mm) - *model.Project(at_mm)).norm() > 0.5;
    }
  }
  ASSERT_GT(scoreable, 300);
  EXPECT_GT(in_range, 0.6 * scoreable);
  EXPECT_GT(smeared, 0.1 * scoreable) << "of " << scoreable;
}

INSTANTIATE_TEST_SUITE_P(All, FoldPresets, testing::Values("pleats", "gathers", "curls"),
                         [](const auto& name) { return std::string(name.param); });

}  // namespace
}  // namespace weft
