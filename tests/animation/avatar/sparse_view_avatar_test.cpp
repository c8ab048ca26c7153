#include "animation/avatar/sparse_view_avatar.h"
#include "animation/sparse_view/sparse_view_training.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "alignment/mesh_graph.h"
#include "animation/sparse_view/sigma_calibration.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

using testing::HasSubstr;

constexpr SparseViewTraining kQuick{.components = 8, .calibration_frames = 8};

TEST(SparseViewAvatar, LearnsTheSameAtAnyNumberOfThreads) {
  const auto one = TrainSparseView(WavingTube::Garment(), WavingTube::Frames(3, 30), kQuick);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  const auto other = TrainSparseView(WavingTube::Garment(), WavingTube::Frames(3, 30), kQuick);
  ASSERT_TRUE(one.ok()) << one.status();
  ASSERT_TRUE(other.ok()) << other.status();
  EXPECT_EQ(one->training_frames, 60);
  EXPECT_EQ(one->held_out_frames, 30);
  const auto a = TablesOf(*one), b = TablesOf(*other);
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].values, b[i].values) << a[i].name;
}

TEST(SparseViewAvatar, KnowsHowLongEdgesAre) {
  const auto avatar = TrainSparseView(WavingTube::Garment(), WavingTube::Frames(3, 30), kQuick);
  ASSERT_TRUE(avatar.ok()) << avatar.status();
  const MeshGraph graph = BuildMeshGraph(WavingTube::Garment().rest);
  ASSERT_EQ(avatar->edge_mm.size(), graph.edges.size());
  for (size_t e = 0; e < graph.edges.size(); e += 37) {
    double sum = 0;
    for (const int take : {0, 1})
      for (int frame = 0; frame < 30; ++frame) {
        const auto mesh = WavingTube::At(frame, take);
        sum += (mesh[graph.edges[e].a] - mesh[graph.edges[e].b]).norm() / 60;
      }
    EXPECT_NEAR(avatar->edge_mm[e], sum, 1e-3);
  }
}

TEST(SparseViewAvatar, WithoutHeldOutTakesTheirEndsAreHeldOut) {
  TrainingFrames frames = WavingTube::Frames(2, 150);
  frames.takes[1].held_out = false;
  const auto avatar = TrainSparseView(WavingTube::Garment(), frames, kQuick);
  ASSERT_TRUE(avatar.ok()) << avatar.status();
  EXPECT_EQ(avatar->training_frames, 270);
  EXPECT_EQ(avatar->held_out_frames, 30);
}

TEST(SparseViewAvatar, GoesThroughTables) {
  const auto avatar = TrainSparseView(WavingTube::Garment(), WavingTube::Frames(3, 30), kQuick);
  ASSERT_TRUE(avatar.ok()) << avatar.status();
  std::vector<AvatarTable> tables = TablesOf(*avatar);
  tables.push_back({"of a later version", 1, 2, false, {1, 2}});
  SparseViewAvatar read;
  ASSERT_TRUE(TakeTables(tables, &read).ok());
  EXPECT_EQ(read.space.basis, avatar->space.basis);
  EXPECT_EQ(read.sigma.of, avatar->sigma.of);
  EXPECT_EQ(read.edge_mm, avatar->edge_mm);
  EXPECT_TRUE(read.Validate().ok()) << read.Validate();
  tables.erase(tables.begin() + 1);
  EXPECT_THAT(TakeTables(tables, &read).message(), HasSubstr("\"basis\" is missing"));
  tables = TablesOf(*avatar);
  tables[1].rows -= 1;
  EXPECT_THAT(TakeTables(tables, &read).message(), HasSubstr("\"basis\""));
}

TEST(SparseViewAvatar, OfBeforeEdgesFollowedTheCarrierHasEdgesThatDoNot) {
  const auto avatar = TrainSparseView(WavingTube::Garment(), WavingTube::Frames(3, 30), kQuick);
  ASSERT_TRUE(avatar.ok()) << avatar.status();
  EXPECT_GT(*std::max_element(avatar->edge_follow.begin(), avatar->edge_follow.end()), 0);
  std::vector<AvatarTable> tables = TablesOf(*avatar);
  std::erase_if(tables, [](const AvatarTable& table) { return table.name == "edge_follow"; });
  SparseViewAvatar read = *avatar;
  ASSERT_TRUE(TakeTables(tables, &read).ok());
  EXPECT_EQ(read.edge_follow, std::vector<float>(read.edge_mm.size(), 0));
  EXPECT_TRUE(read.Validate().ok());
}

TEST(SparseViewAvatar, OfBeforeSigmaGrewWithTheWayHasTypicalFactors) {
  const auto avatar = TrainSparseView(WavingTube::Garment(), WavingTube::Frames(3, 30), kQuick);
  ASSERT_TRUE(avatar.ok()) << avatar.status();
  EXPECT_NE(avatar->sigma.of, TypicalSigmaScale().of);
  std::vector<AvatarTable> tables = TablesOf(*avatar);
  for (AvatarTable& table : tables)
    if (table.name == "sigma_factors") table.name = "sigma_scale";  // as it was called
  SparseViewAvatar read = *avatar;
  ASSERT_TRUE(TakeTables(tables, &read).ok());
  EXPECT_EQ(read.sigma.of, TypicalSigmaScale().of);
}

TEST(SparseViewAvatar, RefusesFramesThatDoNotFit) {
  TrainingFrames frames = WavingTube::Frames(3, 30);
  frames.read = [](int take, int frame) {
    auto mesh = WavingTube::At(frame, take);
    if (take == 1 && frame == 7) mesh.pop_back();
    return mesh;
  };
  EXPECT_THAT(TrainSparseView(WavingTube::Garment(), frames, kQuick).status().message(),
              HasSubstr("take 1, frame 7: has 383 vertices, the template 384"));
  EXPECT_THAT(TrainSparseView(WavingTube::Garment(), WavingTube::Frames(2, 5), kQuick).status().message(),
              HasSubstr("at least 10 are needed"));
  std::stop_source stop;
  const auto stopped = TrainSparseView(
      WavingTube::Garment(), WavingTube::Frames(3, 30), kQuick,
      [&](std::string_view stage, double) {
        if (stage == "lengths") stop.request_stop();
      },
      stop.get_token());
  EXPECT_TRUE(absl::IsCancelled(stopped.status()));
}

void RecordAvatar(const SparseViewAvatar& avatar, Recorded& recorded) {
  for (const AvatarTable& table : TablesOf(avatar)) recorded.Add(table.name, table.values);
  for (const SigmaCheck& check : {avatar.held_out_check, avatar.left_out_check}) {
    recorded.Add("frames", check.frames);
    recorded.Add("one", check.within_one);
    recorded.Add("two", check.within_two);
  }
}

TEST(SparseViewAvatar, StaysAsItIs) {
  Recorded recorded;
  std::vector<std::pair<std::string, double>> told;
  const auto avatar =
      TrainSparseView(WavingTube::Garment(), WavingTube::Frames(3, 24),
                      {.components = 3, .calibration_frames = 6}, [&](std::string_view stage, double share) {
                        if (stage == "sigma") told.emplace_back(stage, share);
                        EXPECT_GE(share, 0);
                        EXPECT_LE(share, 1);
                      });
  ASSERT_TRUE(avatar.ok()) << avatar.status();
  ASSERT_EQ(told.size(), 3u);
  EXPECT_NEAR(told[0].second, 0.35, 1e-12) << "without the first of two motions";
  EXPECT_NEAR(told[1].second, 0.7, 1e-12);
  EXPECT_EQ(told[2].second, 1);
  RecordAvatar(*avatar, recorded);
  recorded.Expect();
}

// Of more frames than are asked for evenly chosen ones are learnt from, and no two follow each other.
TEST(SparseViewAvatar, LearnsFromAsManyFramesAsItMay) {
  TrainingFrames frames = WavingTube::Frames(2, 50);
  frames.takes[1].held_out = false;
  std::set<std::pair<int, int>> read;
  frames.read = [&](int take, int frame) {
    read.emplace(take, frame);
    return WavingTube::At(frame, take);
  };
  const auto avatar = LearnSparseView(WavingTube::Garment(), frames, {.components = 3, .max_frames = 18});
  ASSERT_TRUE(avatar.ok()) << avatar.status();
  EXPECT_EQ(avatar->training_frames, 18);
  EXPECT_EQ(avatar->held_out_frames, 10);
  std::set<std::pair<int, int>> expected;
  for (int k = 0; k < 18; ++k) expected.emplace(k / 9, 5 * (k % 9));
  EXPECT_EQ(read, expected);
  EXPECT_EQ(avatar->acceleration, std::vector<float>(3, 10)) << "nothing is known of how shapes change";
  for (const auto& of_cameras : avatar->sigma.of)
    for (const float factor : of_cameras) EXPECT_EQ(factor, 1);
  EXPECT_EQ(avatar->fps, 30);
  EXPECT_EQ(avatar->template_hash, WavingTube::Garment().ContentHash());
}

}  // namespace
}  // namespace weft
