#include "animation/paper/graph_tracker.h"

#include <gtest/gtest.h>

#include <cmath>

#include "alignment/mesh_graph.h"
#include "animation/paper/graph_fit.h"
#include "animation/paper/graph_prior.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

// A prior of the waving tube, by its graph.
class GraphTrackerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Template garment = WavingTube::Garment();
    GraphOptions options;
    options.nodes = 30;
    graph_ = *BuildDeformationGraph(garment.rest, BuildMeshGraph(garment.rest), options);
    GraphFit fit(graph_, {});
    poses_.clear();
    for (int take = 0; take < 3; ++take)
      for (int frame = 0; frame < 60; frame += 5)
        poses_.push_back(NumbersOf(PoseOfNodes(graph_, *fit.Fit(WavingTube::At(frame, take)))));
    prior_ = *LearnLinearPrior(poses_, PoseUnits(graph_, kPoseUnitMm), 6);
  }
  std::vector<VertexRay> RaysAt(const std::vector<Eigen::Vector3d>& mesh, int cameras) const {
    const std::vector<CameraModel> around = CamerasAround(cameras);
    std::vector<std::vector<Observation>> seen;
    for (const CameraModel& camera : around) seen.push_back(WavingTube::Seen(camera, mesh, 1));
    std::vector<DrivingView> views;
    for (size_t c = 0; c < around.size(); ++c) views.push_back({&around[c], seen[c]});
    return *RaysOf(views, nodes_, 0.1);
  }

  static inline DeformationGraph graph_;
  static inline std::vector<Eigen::VectorXd> poses_;
  static inline GraphPrior prior_;
  NodeVertices nodes_{WavingTube::Garment()};
};

TEST_F(GraphTrackerTest, APriorDecodesThePosesItLearnt) {
  ASSERT_TRUE(prior_.Validate(graph_.nodes()).ok());
  EXPECT_EQ(prior_.latents(), 6);
  EXPECT_FALSE(prior_.Validate(graph_.nodes() + 1).ok());
  // z = 0 is the mean of the poses.
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(poses_[0].size());
  for (const auto& pose : poses_) mean += pose / static_cast<double>(poses_.size());
  EXPECT_LT((NumbersOf(prior_.Decode(Eigen::VectorXd::Zero(6), nullptr)) - mean).norm(), 1e-3 * mean.norm());
}

TEST_F(GraphTrackerTest, WaysOfAPriorAreThoseOfDifferences) {
  GraphPrior deep;
  deep.unit.assign(6 * static_cast<size_t>(graph_.nodes() - 1), 0.5f);
  int from = 3;
  for (const int to : {7, 9, static_cast<int>(deep.unit.size())}) {
    PriorLayer layer{from, to, {}, {}};
    for (int i = 0; i < from * to; ++i)
      layer.weight.push_back(static_cast<float>(NormalOf(4, static_cast<uint64_t>(i))));
    for (int i = 0; i < to; ++i)
      layer.bias.push_back(static_cast<float>(NormalOf(5, static_cast<uint64_t>(i))));
    deep.layers.push_back(layer);
    from = to;
  }
  ASSERT_TRUE(deep.Validate(graph_.nodes()).ok());
  Eigen::VectorXd z(3);
  z << 0.3, -0.8, 0.5;
  Eigen::MatrixXd ways;
  const GraphPose pose = deep.Decode(z, &ways);
  for (int k = 0; k < 3; ++k) {
    constexpr double kStep = 1e-3;
    const Eigen::VectorXd difference =
        (NumbersOf(deep.Decode(z + kStep * Eigen::VectorXd::Unit(3, k), nullptr)) - NumbersOf(pose)) / kStep;
    EXPECT_LT((ways.col(k).tail(difference.size()) - difference).norm(), 1e-2 * difference.norm());
    EXPECT_EQ(ways.col(k).head(6).norm(), 0);
  }
}

TEST_F(GraphTrackerTest, FindsAMotionItDidNotLearn) {
  GraphTracker tracker(graph_, prior_, {});
  for (int frame = 1; frame < 30; frame += 4) {
    const auto mesh = WavingTube::At(frame, 3);
    const TrackedGraph found = tracker.Follow(RaysAt(mesh, 2));
    ASSERT_FALSE(found.lost);
    EXPECT_LT(MeanDistance(tracker.MeshOf(found.state), mesh), 6) << frame;
  }
}

TEST_F(GraphTrackerTest, ThreeCamerasLeaveLessThanTwo) {
  double of_two = 0, of_four = 0;
  for (int frame = 0; frame < 20; frame += 5) {
    const auto mesh = WavingTube::At(frame, 3);
    GraphTracker two(graph_, prior_, {}), four(graph_, prior_, {});
    of_two += MeanDistance(two.MeshOf(two.Follow(RaysAt(mesh, 2)).state), mesh);
    of_four += MeanDistance(four.MeshOf(four.Follow(RaysAt(mesh, 4)).state), mesh);
  }
  EXPECT_LT(of_four, of_two);
}

TEST_F(GraphTrackerTest, TooFewRaysAreALoss) {
  GraphTracker tracker(graph_, prior_, {});
  std::vector<VertexRay> rays = RaysAt(WavingTube::At(0, 0), 2);
  rays.resize(20);
  EXPECT_TRUE(tracker.Follow(rays).lost);
}

TEST_F(GraphTrackerTest, TracksStayAsTheyAre) {
  Recorded recorded;
  recorded.Add("units", prior_.unit);
  recorded.Add("weight", prior_.layers[0].weight);
  recorded.Add("bias", prior_.layers[0].bias);
  GraphTrackerOptions options;
  for (const int most : {1500, 150}) {
    options.max_rays = most;
    GraphTracker tracker(graph_, prior_, options);
    for (const int frame : {1, 5, 25}) {
      const TrackedGraph found = tracker.Follow(RaysAt(WavingTube::At(frame, 3), 2));
      recorded.Add("root", found.state.root.matrix());
      recorded.Add("z", found.state.z);
      recorded.Add("agreeing", found.agreeing_share);
    }
  }
  recorded.Expect();
}

// Rays that agree with no mesh of the prior: the frame is lost, and the next one is found without it.
TEST_F(GraphTrackerTest, ALossIsForgotten) {
  GraphTracker tracker(graph_, prior_, {}), fresh(graph_, prior_, {});
  ASSERT_FALSE(tracker.Follow(RaysAt(WavingTube::At(1, 3), 2)).lost);
  std::vector<VertexRay> scattered = RaysAt(WavingTube::At(2, 3), 2);
  for (size_t i = 0; i < scattered.size(); ++i) {
    const auto k = static_cast<uint64_t>(3 * i);
    scattered[i].direction += 0.15 * Eigen::Vector3d(NormalOf(2, k), NormalOf(2, k + 1), NormalOf(2, k + 2));
    scattered[i].direction.normalize();
  }
  const TrackedGraph lost = tracker.Follow(scattered);
  EXPECT_TRUE(lost.lost);
  EXPECT_LT(lost.agreeing_share, 0.5);
  EXPECT_GT(lost.agreeing_share, 0);
  const auto rays = RaysAt(WavingTube::At(3, 3), 2);
  const TrackedGraph again = tracker.Follow(rays), first = fresh.Follow(rays);
  EXPECT_FALSE(again.lost);
  EXPECT_EQ(again.state.root.matrix(), first.state.root.matrix());
  EXPECT_EQ(again.state.z, first.state.z);
  tracker.Reset();
  EXPECT_EQ(tracker.Follow(rays).state.z, first.state.z);
}

TEST_F(GraphTrackerTest, SixtyRaysAreEnough) {
  GraphTracker tracker(graph_, prior_, {});
  std::vector<VertexRay> rays = RaysAt(WavingTube::At(0, 0), 2), some;
  for (size_t i = 0; i < 60; ++i) some.push_back(rays[i * rays.size() / 60]);
  EXPECT_FALSE(tracker.Follow(some).lost);
  some.pop_back();
  EXPECT_TRUE(tracker.Follow(some).lost);
}

TEST_F(GraphTrackerTest, APriorIsNotOfFewerPosesThanItsComponents) {
  const auto units = PoseUnits(graph_, kPoseUnitMm);
  EXPECT_EQ(LearnLinearPrior({poses_[0]}, units, 6).status().message(),
            "prior of the graph: at least two poses are needed");
  EXPECT_EQ(LearnLinearPrior({poses_[0], poses_[7]}, units, 6)->latents(), 1);
  // The one component is half of the way from one to the other, up to its sign.
  const GraphPrior prior = *LearnLinearPrior({poses_[0], poses_[7]}, units, 6);
  const Eigen::VectorXd ahead = NumbersOf(prior.Decode(Eigen::VectorXd::Ones(1), nullptr)),
                        behind = NumbersOf(prior.Decode(-Eigen::VectorXd::Ones(1), nullptr));
  const double near = 1e-3 * (poses_[7] - poses_[0]).norm();
  EXPECT_LT(std::min((ahead - poses_[0]).norm(), (ahead - poses_[7]).norm()), near);
  EXPECT_LT(std::min((behind - poses_[0]).norm(), (behind - poses_[7]).norm()), near);
}

}  // namespace
}  // namespace weft
