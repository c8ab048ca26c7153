#include "services/work/animation/train_avatar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/animation/net_sample.h"
#include "tests/animation/shift_net.h"
#include "tests/services/work/animation/waving_takes.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class TrainAvatarTest : public testing::Test {
 protected:
  // A trainer whose net moves everything by 3 mm.
  NetRequest ShiftingNet() {
    NetRequest net;
    net.steps = 12, net.hours = 0.5, net.threads = 3;
    net.trainer = [this](const NetTask& task, const std::stop_token&) {
      asked_.push_back(task);
      const AvatarNet shift = ShiftNet();
      EXPECT_TRUE(WriteFileAtomically(task.folder + "/net.onnx", shift.onnx).ok());
      EXPECT_TRUE(WriteFileAtomically(task.folder + "/sample.bin", EncodeNetSample(shift)).ok());
      v1::AvatarNetTraining training;
      training.set_steps(12);
      return WriteJsonFile(task.folder + "/training.json", training);
    };
    return net;
  }
  absl::StatusOr<TrainedAvatar> Train(const AvatarRequest& request) {
    return TrainAvatar(request,
                       [this](std::string_view stage, double share) {
                         if (stages_.empty() || stages_.back() != stage) stages_.emplace_back(stage);
                         EXPECT_GE(share, 0);
                         EXPECT_LE(share, 1);
                       },
                       {});
  }

  WavingTakes& takes_ = WavingTakes::Get();
  const TempFolder folder_;
  AvatarRequest request_ = takes_.Request(folder_ / "tube.avatar");
  std::vector<NetTask> asked_;
  std::vector<std::string> stages_;
};

TEST_F(TrainAvatarTest, TellsWhatItLearntFrom) {
  const auto trained = Train(request_);
  ASSERT_TRUE(trained.ok()) << trained.status();
  EXPECT_EQ(trained->net_remark, "");
  const v1::Avatar& about = trained->file.about;
  EXPECT_EQ(about.template_id(), "tube");
  EXPECT_EQ(about.kind(), kSparseViewKind);
  EXPECT_EQ(about.template_hash(), takes_.garment.ContentHash());
  EXPECT_EQ(about.vertices(), 16 * 24);
  EXPECT_EQ(about.components(), 6);
  EXPECT_EQ(about.training().components(), 6);
  EXPECT_EQ(about.training().calibration_frames(), 6);
  EXPECT_EQ(about.training().max_frames(), 4000);
  EXPECT_EQ(about.training().seed(), 1u);
  EXPECT_EQ(about.fps(), 50);
  EXPECT_EQ(about.training_frames(), 60);
  EXPECT_EQ(about.held_out_frames(), 30);
  EXPECT_GT(about.left_mm(), 0);
  EXPECT_GT(about.held_out_check().frames(), 0);
  EXPECT_GT(about.left_out_check().frames(), 0) << "of two motions";
  EXPECT_FALSE(about.has_net());
  ASSERT_EQ(about.sources_size(), 3);
  EXPECT_EQ(about.sources(0).name(), takes_.walk);
  EXPECT_EQ(about.sources(0).frames(), 30);
  EXPECT_FALSE(about.sources(1).held_out());
  EXPECT_TRUE(about.sources(2).held_out());
  EXPECT_EQ(about.sources(2).motion(), takes_.held);
  EXPECT_EQ(about.sources(0).frames_hash().size(), 16u);
  EXPECT_NE(about.sources(0).frames_hash(), about.sources(1).frames_hash());
  EXPECT_THAT(stages_, ElementsAre("shapes", "lengths", "sigma"));
  const auto read = ReadAvatar(request_.out);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(ChecksumOfAvatar(read->about), ChecksumOfAvatar(about));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(TrainAvatarTest, APlaceThatIsTakenIsSaidBeforeAnythingIsLearnt) {
  WriteBytes(request_.out + "/notes.txt", "mine");
  request_.sources = {"/nowhere"};
  EXPECT_EQ(Train(request_).status().code(), absl::StatusCode::kAlreadyExists);
  request_.out = folder_ / "other.avatar";
  EXPECT_EQ(Train(request_).status().code(), absl::StatusCode::kNotFound);
  request_.training.components = 0;
  EXPECT_EQ(Train(request_).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(stages_.empty());
}

TEST_F(TrainAvatarTest, StopsWithoutAnAvatar) {
  std::stop_source stop;
  const auto trained = TrainAvatar(
      request_, [&](std::string_view, double) { stop.request_stop(); }, stop.get_token());
  EXPECT_EQ(trained.status().code(), absl::StatusCode::kCancelled);
  EXPECT_FALSE(fs::exists(request_.out));
}

TEST_F(TrainAvatarTest, ANetThatDoesNotHelpIsLeftOutWithItsFigures) {
  request_.net = ShiftingNet();
  const auto trained = Train(request_);
  ASSERT_TRUE(trained.ok()) << trained.status();
  EXPECT_THAT(trained->net_remark,
              AllOf(HasSubstr("the net is left out: "), HasSubstr(" without before 2 cameras, "),
                    HasSubstr(" without before 3 cameras"), HasSubstr("train with more motions")));
  EXPECT_FALSE(trained->file.about.has_net());
  EXPECT_FALSE(fs::exists(request_.out + ".training")) << "it has served";
  ASSERT_EQ(asked_.size(), 1u);
  EXPECT_EQ(asked_[0].kind, NetKind::kCorrection);
  EXPECT_EQ(asked_[0].samples, request_.out + ".training/samples.bin");
  EXPECT_EQ(asked_[0].folder, request_.out + ".training");
  EXPECT_EQ(asked_[0].steps, 12);
  EXPECT_EQ(asked_[0].hours, 0.5);
  EXPECT_EQ(asked_[0].seed, 1u);
  EXPECT_EQ(asked_[0].threads, 3);
  EXPECT_THAT(stages_, ElementsAre("spaces", "samples", "shapes", "lengths", "sigma"));
}

TEST_F(TrainAvatarTest, AStoppedNetGoesOnWithItsSamplesAndAFinishedOneIsTaken) {
  const NetRequest shifting = ShiftingNet();
  request_.net = shifting;
  request_.net->keep = true;
  request_.net->trainer = [](const NetTask&, const std::stop_token&) {
    return absl::CancelledError("the trainer was stopped");
  };
  EXPECT_EQ(Train(request_).status().code(), absl::StatusCode::kCancelled);
  const std::string folder = request_.out + ".training";
  EXPECT_THAT(ReadBytes(folder + "/recipe.txt"),
              AllOf(HasSubstr("\ntemplate " + takes_.garment.ContentHash() + "\ncomponents 6\n"),
                    HasSubstr("\nsteps 12\nthreads 3\natlas 1 3\nsource 30 "), HasSubstr("held out 30 ")));
  EXPECT_THAT(ReadBytes(folder + "/samples.bin"), testing::StartsWith("weftsmp1"));
  WriteBytes(folder + "/samples.bin", "those of before");
  stages_.clear();
  request_.net->trainer = shifting.trainer;
  ASSERT_TRUE(Train(request_).ok());
  EXPECT_EQ(asked_.size(), 1u);
  EXPECT_THAT(stages_, ElementsAre("shapes", "lengths", "sigma"));
  EXPECT_EQ(ReadBytes(folder + "/samples.bin"), "those of before");
  ASSERT_TRUE(Train(request_).ok());
  EXPECT_EQ(asked_.size(), 1u) << "training.json is there";
  request_.net->steps = 13;
  EXPECT_EQ(Train(request_).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace weft
