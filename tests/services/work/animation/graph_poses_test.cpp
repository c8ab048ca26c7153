#include "services/work/animation/graph_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <fstream>

#include "alignment/placement.h"
#include "animation/paper/pixel_avatar.h"
#include "base/counter_random.h"
#include "services/work/animation/avatar_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/moving_take.h"
#include "tests/services/work/animation/tube_template.h"

namespace weft {
namespace {

using testing::HasSubstr;

constexpr int kFrames = 6, kEvery = 2;

// Two takes of a tube that a deformation graph moves; the second is held out.
class GraphPosesTest : public testing::Test {
 protected:
  GraphPosesTest()
      : graph_(*BuildDeformationGraph(tube_.rest, BuildMeshGraph(tube_.rest), {12, 4})),
        takes_(*TrainingTakes::Open({WriteTake("bend")}, {WriteTake("hold")}, "", 0)) {}

  // The graph's mesh in a frame: every node turns a little more against its parent.
  std::vector<Eigen::Vector3d> MeshAt(const std::string& take, int frame) const {
    GraphPose pose = GraphPose::Zero(6, graph_.nodes());
    for (int i = 1; i < graph_.nodes(); ++i)
      for (int k = 0; k < 6; ++k)
        pose(k, i) =
            (k < 3 ? 0.02 : 0.4) * frame * NormalOf(KeyOf(7, take), static_cast<uint64_t>(6 * i + k));
    const Eigen::Isometry3d root =
        Eigen::Translation3d(5.0 * frame, 0, 0) * Eigen::AngleAxisd(0.05 * frame, Eigen::Vector3d::UnitY());
    return SkinnedMesh(graph_, PlaceNodes(graph_, root, pose));
  }

  std::string WriteTake(const std::string& name) const {
    return WriteMovingTake(folder_ / name, tube_, kFrames, [&](int frame) { return MeshAt(name, frame); });
  }

  absl::StatusOr<GraphPoses> Fit(const std::stop_token& stop = {}) {
    return FitGraphPoses(
        takes_, graph_, {}, kEvery, [&](double share) { share_ = share; }, stop);
  }

  const TempFolder folder_;
  const Template tube_ = TubeTemplate();
  const DeformationGraph graph_;
  TrainingTakes takes_;
  double share_ = 0;
};

TEST_F(GraphPosesTest, AreThoseThatMadeTheFrames) {
  const absl::StatusOr<GraphPoses> poses = Fit();
  ASSERT_TRUE(poses.ok()) << poses.status();
  EXPECT_EQ(share_, 1);
  // E_Dist keeps nodes a little nearer to each other's motion.
  EXPECT_LT(poses->learnt_left_mm, 0.2);
  EXPECT_LT(poses->held_out_left_mm, 0.2);
  for (const auto& [take, of_take] :
       {std::pair("bend", &poses->learnt), std::pair("hold", &poses->held_out)}) {
    ASSERT_EQ(of_take->size(), kFrames / kEvery);
    for (size_t k = 0; k < of_take->size(); ++k) {
      GraphPose pose = GraphPose::Zero(6, graph_.nodes());
      Eigen::Map<Eigen::VectorXd>(pose.data() + 6, (*of_take)[k].size()) = (*of_take)[k];
      const auto mesh = SkinnedMesh(graph_, PlaceNodes(graph_, Eigen::Isometry3d::Identity(), pose));
      // Where the whole stands is no part of a pose.
      const auto truth = MeshAt(take, kEvery * static_cast<int>(k));
      const Eigen::Isometry3d place = RigidFit(mesh, truth);
      for (size_t v = 0; v < mesh.size(); ++v) EXPECT_LT((place * mesh[v] - truth[v]).norm(), 1) << v;
    }
  }
}

TEST_F(GraphPosesTest, AreTheSameAtAnyNumberOfThreads) {
  const absl::StatusOr<GraphPoses> many = Fit();
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const absl::StatusOr<GraphPoses> one = Fit();
  ASSERT_TRUE(many.ok() && one.ok());
  EXPECT_EQ(many->learnt, one->learnt);
  EXPECT_EQ(many->held_out, one->held_out);
}

TEST_F(GraphPosesTest, EndWhenStoppedAndNameFramesThatAreDamaged) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(absl::IsCancelled(Fit(stop.get_token()).status()));
  std::fstream file(folder_ / "bend/truth/frames.bin", std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(-40, std::ios::end);
  file.put('x').put('y');
  file.close();
  const absl::Status status = FitGraphPoses(takes_, graph_, {}, 1, {}, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(status.message()), HasSubstr("bend"));
}

TEST_F(GraphPosesTest, GoToTheTrainerInTheirUnits) {
  const absl::StatusOr<GraphPoses> poses = Fit();
  ASSERT_TRUE(poses.ok()) << poses.status();
  const std::vector<float> unit = PoseUnits(graph_, kPoseUnitMm);
  const auto tables = DecodeAvatarSpace(EncodePriorTask(graph_, unit, *poses), "poses.bin");
  ASSERT_TRUE(tables.ok()) << tables.status();
  const auto table = [&](const std::string& name) {
    for (const AvatarTable& of : *tables)
      if (of.name == name) return of;
    ADD_FAILURE() << name << " is missing";
    return AvatarTable();
  };
  const AvatarTable learnt = table("pose"), nodes = table("node_mm");
  ASSERT_EQ(learnt.rows, kFrames / kEvery);
  ASSERT_EQ(learnt.columns, 6 * (graph_.nodes() - 1));
  for (int i = 0; i < learnt.columns; ++i)
    EXPECT_NEAR(learnt.values[static_cast<size_t>(learnt.columns + i)] * unit[static_cast<size_t>(i)],
                poses->learnt[1][i], 1e-5);
  EXPECT_EQ(table("held_out_pose").rows, kFrames / kEvery);
  EXPECT_EQ(nodes.rows, graph_.nodes());
  EXPECT_NEAR(nodes.values[4], graph_.NodeMm(1).y(), 1e-4);
  EXPECT_EQ(table("skin_node").columns, 4);
}

TEST(GraphPriorFile, IsReadAndCheckedByItsLayers) {
  const std::vector<float> unit(12, 0.5f);
  PixelAvatar avatar;
  avatar.graph.nodes = 3;
  avatar.prior.unit = unit;
  avatar.prior.layers = {{2, 12, std::vector<float>(24, 0.25f), std::vector<float>(12, 1)}};
  const std::string bytes = EncodeAvatarSpace(TablesOf(avatar));
  const absl::StatusOr<GraphPrior> prior = DecodePrior(bytes, unit, "prior.bin");
  ASSERT_TRUE(prior.ok()) << prior.status();
  EXPECT_EQ(prior->latents(), 2);
  // 0.5 * (0.25 * (4 - 2) + 1)
  EXPECT_NEAR(NumbersOf(prior->Decode(Eigen::Vector2d(4, -2), nullptr))[5], 0.75, 1e-6);
  EXPECT_THAT(std::string(DecodePrior(bytes.substr(0, 90), unit, "prior.bin").status().message()),
              HasSubstr("prior.bin"));
  const absl::Status other = DecodePrior(bytes, std::vector<float>(18, 0.5f), "prior.bin").status();
  EXPECT_EQ(other.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(other.message()), HasSubstr("prior.bin"));
}

}  // namespace
}  // namespace weft
