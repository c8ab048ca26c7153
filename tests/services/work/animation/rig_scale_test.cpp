#include "services/work/animation/rig_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "simulation/studio_rig.h"
#include "tests/animation/recorded.h"
#include "tests/services/work/animation/tube_template.h"

namespace weft {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// What cameras see of the tube at rest: its outer side alone.
std::vector<ViewObservations> ViewsOf(const Template& tube, const Rig& rig) {
  std::vector<ViewObservations> out;
  for (const CameraModel& camera : rig.cameras) {
    ViewObservations view{static_cast<int>(out.size()), {}};
    for (size_t v = 0; v < tube.rest.vertices_mm.size(); ++v) {
      const Eigen::Vector3d& p = tube.rest.vertices_mm[v];
      const Eigen::Vector3d normal(p.x(), 0, p.z());
      const auto pixel = camera.Project(p);
      if (!pixel || normal.dot(camera.CenterWorld() - p) <= 0) continue;
      const VertexNode& node = tube.node_of_vertex[v];
      view.observations.push_back({pixel->x(), pixel->y(), {node.row, node.col, node.kind}, 0.1f, 1});
    }
    out.push_back(view);
  }
  return out;
}

Rig Around(int cameras) {
  StudioRigOptions options;
  options.cameras = cameras;
  options.object_width_mm = 200, options.object_height_mm = 200;
  return *MakeStudioRig("studio", options);
}

Rig InUnitsOf(Rig rig, double mm) {
  for (CameraModel& camera : rig.cameras) camera.translation_mm /= mm;
  return rig;
}

TEST(RigScale, TellsTheUnit) {
  const Template tube = TubeTemplate();
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  for (const int cameras : {2, 3, 8}) {
    const Rig rig = Around(cameras);
    const std::vector<ViewObservations> views = ViewsOf(tube, rig);
    for (const double mm : {1.0, 10.0, 25.4, 1000.0}) {
      const std::optional<double> scale = RigScale(InUnitsOf(rig, mm), views, tube, graph);
      ASSERT_TRUE(scale);
      EXPECT_NEAR(*scale / mm, 1, 0.15) << cameras << " cameras, " << mm;
    }
  }
}

TEST(RigScale, OneCameraSaysNothing) {
  const Template tube = TubeTemplate();
  Rig rig = Around(3);
  std::vector<ViewObservations> views = ViewsOf(tube, rig);
  views[1].observations.clear(), views[2].observations.resize(5);
  EXPECT_FALSE(RigScale(rig, views, tube, BuildMeshGraph(tube.rest)));
}

TEST(RigScale, RefusesWithBothNamesAndTheUnit) {
  EXPECT_TRUE(CheckRigScale(1.2, "rig.json", "shirt").ok());
  const auto why = [](double scale) {
    const absl::Status status = CheckRigScale(scale, "rig.json", "shirt");
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    return std::string(status.message());
  };
  EXPECT_THAT(why(930), AllOf(HasSubstr("rig.json"), HasSubstr("shirt"), HasSubstr("metres")));
  EXPECT_THAT(why(10.4), HasSubstr("centimetres"));
  EXPECT_THAT(why(25), HasSubstr("inches"));
  EXPECT_THAT(why(0.003), HasSubstr("another unit"));
  EXPECT_THAT(why(-3), HasSubstr("is it the rig of this take?"));
}

TEST(RigScale, StaysAsItIs) {
  const Template tube = TubeTemplate();
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  Recorded recorded;
  for (const int cameras : {2, 3, 8}) {
    const Rig rig = Around(cameras);
    std::vector<ViewObservations> views = ViewsOf(tube, rig);
    views[1].observations.push_back({5, 5, {99, 99, NodeKind::kCenter}, 0.1f, 1});  // of no vertex
    recorded.Add("scale", RigScale(rig, views, tube, graph).value_or(-1));
  }
  recorded.Expect();
}

// Forty pairs of neighbours are enough of a view. A row of cells has as many pairs as cells but one.
TEST(RigScale, NeedsPairsOfNeighboursInTwoViews) {
  const Template tube = TubeTemplate();
  const MeshGraph graph = BuildMeshGraph(tube.rest);
  const Rig rig = Around(2);
  const std::vector<ViewObservations> all = ViewsOf(tube, rig);
  const auto pairs_in = [&](const std::vector<Observation>& seen) {
    std::set<int> vertices;
    for (const Observation& o : seen) vertices.insert(60 * o.node.row + o.node.col);
    size_t pairs = 0;
    for (const MeshEdge& e : graph.edges) pairs += vertices.contains(e.a) && vertices.contains(e.b) ? 1 : 0;
    return pairs;
  };
  std::set<bool> enough;
  for (size_t count = 10; count < 60; ++count) {
    std::vector<ViewObservations> views = all;
    views[1].observations.resize(count);
    const size_t pairs = pairs_in(views[1].observations);
    EXPECT_EQ(RigScale(rig, views, tube, graph).has_value(), pairs >= 40) << pairs;
    enough.insert(pairs >= 40);
  }
  EXPECT_EQ(enough.size(), 2u);
  // Both from one side say nothing.
  Rig twice;
  twice.cameras = {rig.cameras[0], rig.cameras[0]};
  EXPECT_FALSE(RigScale(twice, {{0, all[0].observations}, {1, all[0].observations}}, tube, graph));
}

TEST(RigScale, OfEachUnitHasItsRange) {
  const auto unit_of = [](double scale) {
    const std::string words(CheckRigScale(scale, "r", "t").message());
    for (const char* unit : {"in metres", "in inches", "in centimetres", "in another unit", "look away"})
      if (words.find(unit) != std::string::npos) return std::string(unit);
    return words;
  };
  EXPECT_EQ(unit_of(0.51), "");
  EXPECT_EQ(unit_of(1.99), "");
  EXPECT_EQ(unit_of(0.5), "in another unit");
  EXPECT_EQ(unit_of(2), "in another unit");
  EXPECT_EQ(unit_of(5), "in another unit");
  EXPECT_EQ(unit_of(5.1), "in centimetres");
  EXPECT_EQ(unit_of(13), "in centimetres");
  EXPECT_EQ(unit_of(19.9), "in centimetres");
  EXPECT_EQ(unit_of(20), "in inches");
  EXPECT_EQ(unit_of(50), "in inches");
  EXPECT_EQ(unit_of(51), "in another unit");
  EXPECT_EQ(unit_of(500), "in another unit");
  EXPECT_EQ(unit_of(501), "in metres");
  EXPECT_EQ(unit_of(1999), "in metres");
  EXPECT_EQ(unit_of(2000), "in another unit");
  EXPECT_EQ(unit_of(0), "look away");
  EXPECT_EQ(
      CheckRigScale(932.44, "r", "t").message(),
      "r: its positions are to be multiplied by about 932 so that its cameras see the garment of t in one "
      "place; they seem to be in metres, and weft's are in mm");
}

}  // namespace
}  // namespace weft
