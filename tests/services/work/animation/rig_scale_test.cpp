#include "services/work/animation/rig_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "simulation/studio_rig.h"
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

}  // namespace
}  // namespace weft
