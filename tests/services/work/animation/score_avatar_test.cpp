#include "services/work/animation/score_avatar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <utility>

#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/template_file.h"
#include "tests/animation/recorded.h"
#include "tests/services/work/animation/tube_set.h"
#include "tests/services/work/animation/waving_takes.h"
#include "weft/v1/job.pb.h"

namespace weft {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ScoreAvatarTest : public testing::Test {
 protected:
  ScoreAvatarTest() {
    scoring_.avatar = takes_.Avatar();
    scoring_.sources = {takes_.Write(folder_ / "test", 12, 17)};
    scoring_.cameras = {2};
  }
  absl::StatusOr<v1::AvatarEvaluation> Score() {
    return ScoreAvatar(
        scoring_, [this](size_t done, size_t all) { told_.emplace_back(done, all); }, stop_.get_token());
  }
  // By cameras and method.
  std::map<std::pair<int, std::string>, v1::AvatarScore> Rows() {
    const auto scored = Score();
    EXPECT_TRUE(scored.ok()) << scored.status();
    std::map<std::pair<int, std::string>, v1::AvatarScore> rows;
    if (!scored.ok()) return rows;
    for (const v1::AvatarScore& row : scored->scores()) rows[{row.cameras(), row.method()}] = row;
    EXPECT_EQ(rows.size(), static_cast<size_t>(scored->scores_size())) << "each row once";
    return rows;
  }
  std::string WhyNot() { return std::string(Score().status().message()); }

  WavingTakes& takes_ = WavingTakes::Get();
  const TempFolder folder_;
  AvatarScoring scoring_;
  std::vector<std::pair<size_t, size_t>> told_;
  std::stop_source stop_;
};

TEST_F(ScoreAvatarTest, DrivenMeshesStandBesideCarrierAndShapes) {
  scoring_.cameras = {2, 3};
  scoring_.threads = 2;
  auto rows = Rows();
  ASSERT_EQ(rows.size(), 6u);
  for (const auto& [key, row] : rows) {
    EXPECT_EQ(row.split(), scoring_.sources[0]) << "a take of no data set is its own";
    EXPECT_EQ(row.frames() + row.lost_frames(), 12) << key.second;
  }
  for (const int cameras : {2, 3}) {
    const v1::AvatarScore &driven = rows[{cameras, "driven"}], &carrier = rows[{cameras, "carrier"}];
    EXPECT_EQ(driven.frames(), 12);
    EXPECT_EQ(driven.lost_frames(), 0);
    EXPECT_EQ(driven.threads(), 2);
    EXPECT_GT(driven.ms_a_frame(), 0);
    EXPECT_EQ(carrier.ms_a_frame(), 0);
    EXPECT_GT(driven.cells_a_view(), 20);
    EXPECT_LT(driven.mean_mm(), 10);
    EXPECT_NE(driven.mean_mm(), carrier.mean_mm());
    EXPECT_LT(driven.seen_mm(), driven.unseen_mm() + 5);
    EXPECT_GT(driven.error_jitter_seen_mm(), 0);
    EXPECT_GT(driven.share_within_two_sigma(), 0.5);
    EXPECT_EQ(carrier.share_within_two_sigma(), -1) << "it has no sigma";
    // A tube that is closed by its faces has no seams on the board but where its columns end.
    EXPECT_GT(driven.at_seams_mm() + driven.off_seams_mm(), 0);
    EXPECT_FALSE(driven.has_from_registered_mm());
  }
  const v1::AvatarScore &best = rows[{0, "best shape"}], &mean = rows[{0, "mean shape"}];
  EXPECT_EQ(best.frames(), 12) << "once, whatever the numbers of cameras";
  EXPECT_LT(best.mean_mm(), mean.mean_mm());
  EXPECT_EQ(told_.size(), 24u);
  EXPECT_EQ(told_.front(), std::pair(size_t{1}, size_t{24}));
  EXPECT_EQ(told_.back(), std::pair(size_t{24}, size_t{24}));
}

TEST_F(ScoreAvatarTest, EightCamerasAreEnoughToRegisterBy) {
  scoring_.cameras = {7, 8};
  auto rows = Rows();
  EXPECT_FALSE(rows.contains({7, "registered"}));
  ASSERT_TRUE(rows.contains({8, "registered"}));
  EXPECT_EQ((rows[{8, "registered"}].frames() + rows[{8, "registered"}].lost_frames()), 12);
  EXPECT_LT((rows[{8, "registered"}].mean_mm()), 10);
  EXPECT_TRUE((rows[{8, "driven"}].has_from_registered_mm()));
  EXPECT_GT((rows[{8, "driven"}].from_registered_mm()), 0);
  EXPECT_LT((rows[{8, "driven"}].from_registered_mm()), 10);
}

TEST_F(ScoreAvatarTest, ARangeOfFramesIsScoredAlone) {
  scoring_.frames = {4, 7};
  EXPECT_EQ((Rows()[{2, "driven"}].frames()), 3);
  EXPECT_EQ(told_.back(), std::pair(size_t{3}, size_t{3}));
  scoring_.frames = {10, 100};
  EXPECT_EQ((Rows()[{2, "driven"}].frames()), 2);
  scoring_.frames = {12, 100};
  EXPECT_EQ(Score().status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(WhyNot(), HasSubstr("has 12, none of them from 12 on"));
}

TEST_F(ScoreAvatarTest, TheSameAtAnyNumberOfThreads) {
  const auto one = Rows();
  scoring_.threads = 2;
  const auto two = Rows();
  for (const auto& [key, row] : one) {
    EXPECT_EQ(row.mean_mm(), two.at(key).mean_mm()) << key.second;
    EXPECT_EQ(row.error_jitter_unseen_mm(), two.at(key).error_jitter_unseen_mm()) << key.second;
  }
}

TEST_F(ScoreAvatarTest, MeshesAreWrittenBesideTheTruthWhereAskedFor) {
  scoring_.meshes = folder_ / "meshes";
  scoring_.frames = {3, 5};
  Rows();
  for (const char* frame : {"0003", "0004"}) {
    const std::string folder = folder_ / ("meshes/test-2/" + std::string(frame));
    const auto mesh = ReadRegisteredMesh(folder + "/mesh.ply");
    const auto truth = ReadMesh(folder + "/truth.ply");
    ASSERT_TRUE(mesh.ok() && truth.ok()) << mesh.status() << truth.status();
    EXPECT_EQ(mesh->vertices_mm.size(), truth->vertices_mm.size());
    const auto is = WavingTube::At(frame[3] - '0', 17);
    EXPECT_LT((truth->vertices_mm[100] - is[100]).norm(), 0.1);
    EXPECT_GT(mesh->sigma_mm[0], 0);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "meshes/test-2/0002"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "meshes/test-2/0005"));
}

TEST_F(ScoreAvatarTest, TrialsDriveElsewhereInTheDarkAndFrameByFrame) {
  scoring_.with_trials = true;
  scoring_.sources = {takes_.Write(folder_ / "long", 45, 17)};
  auto rows = Rows();
  const auto frames = [&](const char* method) {
    const v1::AvatarScore& row = rows[{2, method}];
    return row.frames() + row.lost_frames();
  };
  EXPECT_EQ(frames("elsewhere"), 90) << "in two other places";
  EXPECT_EQ(frames("frame by frame"), 45);
  EXPECT_EQ(frames("one dark"), 15);
  EXPECT_EQ(frames("after dark"), 10);
  EXPECT_EQ(frames("never dark"), 10);
  EXPECT_LT((rows[{2, "one dark"}].cells_a_view()), 0.7 * (rows[{2, "never dark"}].cells_a_view()));
  EXPECT_GE((rows[{2, "one dark"}].mean_mm()), (rows[{2, "driven"}].mean_mm()));
  EXPECT_NE((rows[{2, "frame by frame"}].mean_mm()), (rows[{2, "driven"}].mean_mm()));
  scoring_.sources = {takes_.Write(folder_ / "short", 44, 17)};
  rows = Rows();
  EXPECT_FALSE(rows.contains({2, "one dark"})) << "too short";
  EXPECT_EQ(frames("frame by frame"), 44);
}

TEST_F(ScoreAvatarTest, AnotherTemplateIsRefusedWithBothNames) {
  Template other = takes_.garment;
  other.rest.vertices_mm[0].x() += 1;
  scoring_.sources = {
      WriteMovingTake(folder_ / "other", other, 2, [](int k) { return WavingTube::At(k, 17); })};
  EXPECT_EQ(Score().status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(WhyNot(),
              AllOf(HasSubstr("tube.avatar"), HasSubstr(folder_ / "other"), HasSubstr(other.ContentHash())));
}

TEST_F(ScoreAvatarTest, ResultsAreNoTruth) {
  const std::string result = folder_ / "result";
  v1::Job job;
  job.mutable_spec()->set_garment(takes_.walk + "/template");
  job.mutable_inputs()->set_garment(takes_.garment.ContentHash());
  std::filesystem::create_directories(result + "/0000");
  ASSERT_TRUE(WriteJsonFile(result + "/job.json", job).ok());
  v1::FrameReport report;
  report.set_state(v1::FRAME_STATE_DONE);
  ASSERT_TRUE(WriteJsonFile(result + "/0000/report.json", report).ok());
  ASSERT_TRUE(WriteMesh(result + "/0000/mesh.ply", takes_.garment.rest).ok());
  scoring_.sources = {result};
  EXPECT_EQ(Score().status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(WhyNot(), HasSubstr("is no simulated take"));
}

TEST_F(ScoreAvatarTest, StopsBetweenFrames) {
  const auto scored = ScoreAvatar(
      scoring_, [this](size_t, size_t) { stop_.request_stop(); }, stop_.get_token());
  EXPECT_EQ(scored.status().code(), absl::StatusCode::kCancelled);
}

TEST_F(ScoreAvatarTest, EveryOptionHasItsLimits) {
  const auto is_valid = [this](auto&& change) {
    AvatarScoring scoring = scoring_;
    change(scoring);
    return scoring.Validate().ok();
  };
  EXPECT_TRUE(is_valid([](AvatarScoring& s) { s.cameras = {1, 1000}; }));
  EXPECT_FALSE(is_valid([](AvatarScoring& s) { s.cameras = {2, 0}; }));
  EXPECT_FALSE(is_valid([](AvatarScoring& s) { s.cameras = {1001}; }));
  EXPECT_FALSE(is_valid([](AvatarScoring& s) { s.cameras = {}; }));
  EXPECT_FALSE(is_valid([](AvatarScoring& s) { s.sources = {}; }));
  EXPECT_TRUE(is_valid([](AvatarScoring& s) { s.frames = {4, 5}; }));
  EXPECT_FALSE(is_valid([](AvatarScoring& s) { s.frames = {5, 5}; }));
  EXPECT_TRUE(is_valid([](AvatarScoring& s) { s.fps = 0; }));
  EXPECT_FALSE(is_valid([](AvatarScoring& s) { s.fps = -1; }));
  EXPECT_FALSE(is_valid([](AvatarScoring& s) { s.threads = 0; }));
}

// All rows of all methods that an imitated decoder serves, but for their times.
std::string RowsText(v1::AvatarEvaluation scored, const std::string& folder) {
  scored.clear_avatar();
  for (v1::AvatarScore& row : *scored.mutable_scores()) {
    row.clear_ms_a_frame();
    if (row.split().starts_with(folder)) row.set_split("take");
  }
  return *ToJson(scored, JsonZeros::kOmitted);
}

TEST_F(ScoreAvatarTest, RowsStayAsTheyAre) {
  scoring_.cameras = {1, 2, 8};
  scoring_.frames = {0, 4};
  const auto scored = Score();
  ASSERT_TRUE(scored.ok()) << scored.status();
  EXPECT_EQ(scored->avatar(), scoring_.avatar);
  ExpectRecorded(RowsText(*scored, folder_.path()));
  scoring_.seed = 2;
  EXPECT_NE(RowsText(*Score(), folder_.path()), RowsText(*scored, folder_.path()));
}

TEST_F(ScoreAvatarTest, TrialsStayAsTheyAre) {
  scoring_.with_trials = true;
  scoring_.sources = {takes_.Write(folder_ / "long", 45, 17)};
  const auto scored = Score();
  ASSERT_TRUE(scored.ok()) << scored.status();
  ExpectRecorded(RowsText(*scored, folder_.path()));
}

TEST_F(ScoreAvatarTest, OfADataSetTheSplitsThatAreAskedFor) {
  const std::string set = WriteTubeSet(folder_ / "set");
  scoring_.sources = {set};
  scoring_.splits = {"test-unseen"};
  const auto unseen = Score();
  ASSERT_TRUE(unseen.ok()) << unseen.status();
  EXPECT_EQ(told_.size(), 4u);
  std::vector<std::string> methods;
  for (const v1::AvatarScore& row : unseen->scores()) {
    EXPECT_EQ(row.split(), "test-unseen");
    methods.push_back(row.method());
  }
  EXPECT_THAT(methods, testing::ElementsAre("mean shape", "best shape", "carrier", "driven", "hand before"));
  EXPECT_EQ(unseen->scores(4).mean_mm(), unseen->scores(3).mean_mm()) << "the motion is that of reaching";
  ASSERT_EQ(unseen->floor_size(), 1);
  v1::AvatarEvaluation floor;
  *floor.add_floor() = unseen->floor(0);
  ExpectRecorded(*ToJson(floor));
  scoring_.splits = {"validate"};
  const auto validated = Score();
  ASSERT_TRUE(validated.ok()) << validated.status();
  for (const v1::AvatarScore& row : validated->scores()) EXPECT_NE(row.method(), "hand before");
  scoring_.splits = {"a", "b"};
  EXPECT_EQ(Score().status(), absl::NotFoundError(set + ": has no complete take of the splits a, b"));
}

TEST_F(ScoreAvatarTest, SaysWhichOptionIsWrong) {
  const auto why_not = [this](auto&& change) {
    AvatarScoring scoring = scoring_;
    change(scoring);
    return std::string(scoring.Validate().message());
  };
  EXPECT_EQ(why_not([](AvatarScoring& s) { s.sources = {}; }), "no take to be driven is given");
  EXPECT_EQ(why_not([](AvatarScoring& s) { s.cameras = {}; }), "cameras: no number of them is given");
  EXPECT_EQ(why_not([](AvatarScoring& s) { s.cameras = {0}; }), "cameras: 0 of them, expected 1 to 1000");
  EXPECT_EQ(why_not([](AvatarScoring& s) {
              s.frames = {5, 5};
            }),
            "frames: the range must end behind its first frame");
  EXPECT_EQ(why_not([](AvatarScoring& s) { s.fps = -1; }), "fps must not be negative");
  EXPECT_EQ(why_not([](AvatarScoring& s) { s.threads = 0; }), "threads must be 1 or more");
}

}  // namespace
}  // namespace weft
