#include "services/work/animation/train_pixel_avatar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <map>
#include <utility>

#include "animation/paper/graph_prior.h"
#include "animation/paper/pixel_driver.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/net_sample.h"
#include "services/work/animation/score_avatar.h"
#include "tests/animation/recorded.h"
#include "tests/services/work/animation/waving_takes.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class TrainPixelAvatarTest : public testing::Test {
 protected:
  TrainPixelAvatarTest() {
    request_.sources = {Write("walk", 20, 0)};
    request_.held_out = {Write("held", 4, 3)};
    request_.graph.nodes = 8;
    request_.every = 4;
    request_.samples.every = 5, request_.samples.displaced = 2, request_.samples.atlas.level = 0;
    request_.steps = 7, request_.hours = 0.5, request_.threads = 2, request_.seed = 5;
    request_.out = folder_ / "paper.avatar";
    request_.trainer = [this](const NetTask& task, const std::stop_token&) {
      asked_.push_back(task);
      return task.kind == NetKind::kPrior ? TrainPrior(task) : TrainNet(task);
    };
  }

  // Seen by two cameras that face each other.
  std::string Write(const std::string& name, int frames, int seed) const {
    const std::string path = takes_.Write(folder_ / name, frames, seed);
    EXPECT_TRUE(WriteRig(path + "/rig.json", {"two", CamerasAround(2)}).ok());
    return path;
  }
  // Principal components in the place of a decoder.
  static absl::Status TrainPrior(const NetTask& task) {
    const auto tables = DecodeAvatarSpace(ReadBytes(task.samples), task.samples);
    EXPECT_TRUE(tables.ok()) << tables.status();
    std::vector<Eigen::VectorXd> poses;
    for (const AvatarTable& table : *tables) {
      if (table.name != "pose") continue;
      for (int row = 0; row < table.rows; ++row)
        poses.push_back(
            Eigen::Map<const Eigen::VectorXf>(table.values.data() + row * table.columns, table.columns)
                .cast<double>());
    }
    EXPECT_EQ(poses.size(), 5u) << "every fourth of twenty";
    PixelAvatar avatar;
    const auto units = std::vector<float>(static_cast<size_t>(poses.front().size()), 1);
    const auto prior = LearnLinearPrior(poses, units, 3);
    EXPECT_TRUE(prior.ok()) << prior.status();
    avatar.prior = *prior;
    avatar.graph.nodes = avatar.prior.nodes();
    return WriteFileAtomically(task.folder + "/prior.bin", EncodeAvatarSpace(TablesOf(avatar)));
  }
  static absl::Status TrainNet(const NetTask& task) {
    AvatarNet net;
    net.onnx = ReadBytes(WEFT_TEST_DATA "/pixels.onnx");
    net.sample = {4, 1, 1, {1, 1, 1, 1}};
    net.sample_answer = {3, 1, 1, {0.5f, -0.25f, 1.5f}};
    absl::Status status = WriteFileAtomically(task.folder + "/net.onnx", net.onnx);
    status.Update(WriteFileAtomically(task.folder + "/sample.bin", EncodeNetSample(net)));
    v1::AvatarNetTraining training;
    training.set_steps(7);
    status.Update(WriteJsonFile(task.folder + "/training.json", training));
    return status;
  }
  absl::StatusOr<PixelAvatarFile> Train() {
    return TrainPixelAvatar(request_,
                            [this](std::string_view stage, double) {
                              if (stages_.empty() || stages_.back() != stage) stages_.emplace_back(stage);
                            },
                            {});
  }

  WavingTakes& takes_ = WavingTakes::Get();
  const TempFolder folder_;
  PixelAvatarRequest request_;
  std::vector<NetTask> asked_;
  std::vector<std::string> stages_;
};

TEST_F(TrainPixelAvatarTest, AsksForAPriorAndThenForANet) {
  request_.keep = true;
  const auto trained = Train();
  ASSERT_TRUE(trained.ok()) << trained.status();
  const v1::Avatar& about = trained->about;
  EXPECT_EQ(about.kind(), "paper");
  EXPECT_EQ(about.template_hash(), takes_.garment.ContentHash());
  EXPECT_EQ(about.board_hash(), takes_.garment.board_hash);
  EXPECT_EQ(about.vertices(), 16 * 24);
  EXPECT_EQ(about.components(), 3);
  EXPECT_EQ(about.fps(), 50);
  EXPECT_EQ(about.training_frames(), 20);
  EXPECT_EQ(about.held_out_frames(), 4);
  EXPECT_GT(about.left_mm(), 0);
  EXPECT_EQ(about.net().training().steps(), 7);
  EXPECT_EQ(about.sources_size(), 2);
  EXPECT_EQ(trained->avatar.graph.nodes, 8);
  EXPECT_THAT(stages_, ElementsAre("graph", "samples"));
  const std::string folder = request_.out + ".training";
  ASSERT_EQ(asked_.size(), 2u);
  EXPECT_EQ(asked_[0].kind, NetKind::kPrior);
  EXPECT_EQ(asked_[0].samples, folder + "/poses.bin");
  EXPECT_EQ(asked_[0].folder, folder);
  EXPECT_EQ(asked_[0].steps, 3) << "half as many";
  EXPECT_EQ(asked_[0].hours, 0);
  EXPECT_EQ(asked_[0].seed, 5u);
  EXPECT_EQ(asked_[0].threads, 2);
  EXPECT_EQ(asked_[1].kind, NetKind::kPixels);
  EXPECT_EQ(asked_[1].samples, folder + "/samples.bin");
  EXPECT_EQ(asked_[1].steps, 7);
  EXPECT_EQ(asked_[1].hours, 0.5);
  EXPECT_EQ(asked_[1].seed, 5u);
  EXPECT_EQ(asked_[1].threads, 2);
  EXPECT_THAT(
      ReadBytes(folder + "/recipe.txt"),
      AllOf(HasSubstr("\npreset paper\n"), HasSubstr("\ngraph 8 "), HasSubstr("\nsamples 5 2 2 0 3\n"),
            HasSubstr("\nseed 5\nsteps 7\nthreads 2\n"), HasSubstr("held out 4 ")));

  // Frames 0, 5, 10 and 15 with two displaced ones each, and each that is held out by itself.
  const std::string bytes = ReadBytes(folder + "/samples.bin");
  uint32_t head[5];  // features, answers, height, width, texels
  std::memcpy(head, bytes.data() + 8, sizeof(head));
  EXPECT_EQ(head[0], static_cast<uint32_t>(kPixelFeatures) + 6) << "with tangents";
  EXPECT_EQ(head[1], static_cast<uint32_t>(kPixelAnswers));
  std::map<std::pair<uint32_t, uint32_t>, int> samples_of;
  const size_t sample_bytes = 16 + size_t{2} * head[4] * (head[0] + head[1]);
  for (size_t at = 28 + size_t{5} * head[4]; at < bytes.size(); at += sample_bytes) {
    uint32_t of[4];  // split, take, frame, cameras
    std::memcpy(of, bytes.data() + at, sizeof(of));
    EXPECT_EQ(of[0], of[1]) << "the second take is held out";
    EXPECT_EQ(of[3], 2u);
    ++samples_of[{of[1], of[2]}];
  }
  const std::map<std::pair<uint32_t, uint32_t>, int> expected = {{{0, 0}, 3},  {{0, 5}, 3}, {{0, 10}, 3},
                                                                 {{0, 15}, 3}, {{1, 0}, 1}, {{1, 1}, 1},
                                                                 {{1, 2}, 1},  {{1, 3}, 1}};
  EXPECT_EQ(samples_of, expected);

  // What stands is not made again.
  stages_.clear();
  ASSERT_TRUE(Train().ok());
  EXPECT_EQ(asked_.size(), 2u);
  EXPECT_TRUE(stages_.empty());
  WriteBytes(folder + "/left.txt", "much");
  EXPECT_EQ(Train().status().code(), absl::StatusCode::kDataLoss);
  request_.steps = 8;
  EXPECT_EQ(Train().status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(TrainPixelAvatarTest, IsDrivenBesideAnAvatarThatIsScored) {
  ASSERT_TRUE(Train().ok());
  EXPECT_FALSE(fs::exists(request_.out + ".training")) << "it has served";
  AvatarScoring scoring;
  scoring.avatar = takes_.Avatar();
  scoring.baseline = request_.out;
  scoring.sources = {Write("test", 3, 17)};
  scoring.cameras = {2, 3};
  const auto scored = ScoreAvatar(scoring, {}, {});
  ASSERT_TRUE(scored.ok()) << scored.status();
  std::vector<std::string> papers;
  for (const v1::AvatarScore& row : scored->scores()) {
    if (row.method().find("paper") == std::string::npos) continue;
    papers.push_back(row.method());
    EXPECT_EQ(row.cameras(), 2) << "it knows no other number";
    EXPECT_EQ(row.frames() + row.lost_frames(), 3);
    EXPECT_EQ(row.ms_a_frame() > 0, row.method() == "paper");
  }
  EXPECT_THAT(papers, ElementsAre("paper carrier", "paper"));
}

TEST_F(TrainPixelAvatarTest, LearnsFromTwoCamerasThatStayWhereTheyAre) {
  fs::remove(request_.held_out[0] + "/rig.json");
  const absl::Status status = Train().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr(request_.held_out[0] + " is seen by other cameras than " + request_.sources[0]),
                    HasSubstr("rig.json")));
}

TEST_F(TrainPixelAvatarTest, APlaceThatIsTakenIsSaidBeforeAnythingIsLearnt) {
  WriteBytes(request_.out + "/notes.txt", "mine");
  EXPECT_EQ(Train().status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_TRUE(stages_.empty());
}

TEST_F(TrainPixelAvatarTest, StopsWithoutAnAvatar) {
  std::stop_source stop;
  const auto trained = TrainPixelAvatar(
      request_, [&](std::string_view, double) { stop.request_stop(); }, stop.get_token());
  EXPECT_EQ(trained.status().code(), absl::StatusCode::kCancelled);
  EXPECT_FALSE(fs::exists(request_.out));
}

TEST_F(TrainPixelAvatarTest, PosesStayAsTheyAre) {
  request_.keep = true;
  const auto trained = Train();
  ASSERT_TRUE(trained.ok()) << trained.status();
  Recorded recorded;
  recorded.Add("left", trained->avatar.left_mm);
  const std::string folder = request_.out + ".training";
  const std::string poses = ReadBytes(folder + "/poses.bin");
  recorded.Add("poses.bin", std::vector<uint8_t>(poses.begin(), poses.end()));
  recorded.Expect();
  // The prior is there, and what it was learnt from is not needed any more.
  fs::remove(folder + "/poses.bin"), fs::remove(folder + "/samples.bin");
  stages_.clear();
  ASSERT_TRUE(Train().ok());
  EXPECT_THAT(stages_, ElementsAre("samples"));
  EXPECT_EQ(asked_.size(), 2u);
}

}  // namespace
}  // namespace weft
