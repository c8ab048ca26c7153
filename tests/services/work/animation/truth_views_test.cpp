#include "services/work/animation/truth_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/animation/recorded.h"
#include "tests/services/work/animation/tube_template.h"

namespace weft {
namespace {

class Views : public testing::Test {
 protected:
  const Template tube_ = TubeTemplate();
  const TruthViews views_{tube_, BodyShape()};
  const ClothFrame frame_{0, tube_.rest.vertices_mm, {}};
};

// The tube is as large as a shirt's sleeve, so two cameras that face each other see nearly all of it, each
// its own half.
TEST_F(Views, FacingCamerasSeeTheirOwnHalves) {
  const Rig rig = *DrivingRig(2, frame_.vertices_mm, 1);
  const auto seen = views_.Observe(frame_, rig, 1);
  ASSERT_TRUE(seen.ok()) << seen.status();
  ASSERT_EQ(seen->size(), 2u);
  std::set<BoardNode> nodes[2];
  for (int v = 0; v < 2; ++v)
    for (const Observation& o : (*seen)[static_cast<size_t>(v)].observations) {
      EXPECT_TRUE(nodes[v].insert(o.node).second);
      const auto vertex = static_cast<size_t>(60 * o.node.row + o.node.col);
      const Eigen::Vector3d& p = tube_.rest.vertices_mm[vertex];
      const CameraModel& camera = rig.cameras[static_cast<size_t>(v)];
      EXPECT_GT(Eigen::Vector3d(p.x(), 0, p.z()).dot(camera.CenterWorld() - p), 0);
      EXPECT_LT((*camera.Project(p) - Eigen::Vector2d(o.x_px, o.y_px)).norm(), 6 * o.sigma_px);
    }
  EXPECT_GT(nodes[0].size() + nodes[1].size(), 600u);
  std::set<BoardNode> both;
  std::set_intersection(nodes[0].begin(), nodes[0].end(), nodes[1].begin(), nodes[1].end(),
                        std::inserter(both, both.end()));
  EXPECT_LT(both.size(), 60u);
}

TEST_F(Views, NoiseFollowsTheSeedAlone) {
  const Rig rig = *DrivingRig(3, frame_.vertices_mm, 1);
  const auto a = *views_.Observe(frame_, rig, 5), again = *views_.Observe(frame_, rig, 5),
             other = *views_.Observe(frame_, rig, 6);
  ASSERT_FALSE(a[0].observations.empty());
  EXPECT_EQ(a[0].observations[0].x_px, again[0].observations[0].x_px);
  EXPECT_NE(a[0].observations[0].x_px, other[0].observations[0].x_px);
}

// A person in the tube, whose arms and trunk are thicker than it, hides it.
TEST_F(Views, TheWearerHidesCloth) {
  ClothFrame worn = frame_;
  worn.pose.emplace();
  const Rig rig = *DrivingRig(2, frame_.vertices_mm, 1);
  const auto bare = *views_.Observe(frame_, rig, 1), hidden = *views_.Observe(worn, rig, 1);
  EXPECT_LT(hidden[0].observations.size() + hidden[1].observations.size(),
            bare[0].observations.size() + bare[1].observations.size());
}

TEST_F(Views, StayAsTheyAre) {
  Recorded recorded;
  for (const DrivingPlaces& places : {DrivingPlaces{}, DrivingPlaces{140, 3000}}) {
    const Rig rig = *DrivingRig(3, frame_.vertices_mm, 2, places);
    EXPECT_EQ(rig.id, "driving");
    const auto seen = views_.Observe(frame_, rig, 5);
    ASSERT_TRUE(seen.ok()) << seen.status();
    for (const ViewObservations& view : *seen) {
      std::vector<double> pixels;
      for (const Observation& o : view.observations) pixels.push_back(o.x_px), pixels.push_back(o.y_px);
      recorded.Add("camera " + std::to_string(view.camera), pixels);
      recorded.Add("center", rig.cameras[static_cast<size_t>(view.camera)].CenterWorld());
    }
  }
  ClothFrame worn = frame_;
  worn.pose.emplace();
  const Rig rig = *DrivingRig(2, frame_.vertices_mm, 1);
  const auto of_worn = views_.Observe(worn, rig, 1);
  ASSERT_TRUE(of_worn.ok()) << of_worn.status();
  for (const ViewObservations& view : *of_worn)
    recorded.Add("worn", static_cast<double>(view.observations.size()));
  recorded.Expect();
}

}  // namespace
}  // namespace weft
