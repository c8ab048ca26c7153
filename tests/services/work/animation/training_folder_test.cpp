#include "services/work/animation/training_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/work/animation/net_sample.h"
#include "tests/animation/shift_net.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(TrainingFolder, LiesBesideTheAvatar) {
  EXPECT_EQ(TrainingFolderOf("a/x.avatar"), "a/x.avatar.training");
  EXPECT_EQ(TrainingFolderOf("a/b/../x.avatar/"), "a/x.avatar.training");
}

TEST(TrainingFolder, HasALineForEachSource) {
  v1::Avatar about;
  v1::AvatarSource& learnt = *about.add_sources();
  learnt.set_name("walk 1"), learnt.set_frames(40), learnt.set_motion("walk"), learnt.set_frames_hash("01ab");
  v1::AvatarSource& held = *about.add_sources();
  held.set_name("walk 2"), held.set_frames(7), held.set_motion("walk"), held.set_frames_hash("02");
  held.set_held_out(true);
  EXPECT_EQ(SourceLines(about), "source 40 walk 01ab walk 1\nheld out 7 walk 02 walk 2\n");
}

TEST(TrainingFolder, IsOfOneRecipe) {
  const TempFolder temp;
  const std::string folder = temp / "x.avatar.training";
  ASSERT_TRUE(BeginTrainingFolder(folder, "recipe").ok());
  EXPECT_EQ(ReadBytes(folder + "/recipe.txt"), "recipe");
  WriteBytes(folder + "/samples.bin", "samples");
  EXPECT_TRUE(BeginTrainingFolder(folder, "recipe").ok());
  const absl::Status status = BeginTrainingFolder(folder, "another");
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr(folder), HasSubstr("recipe.txt")));
  EXPECT_EQ(ReadBytes(folder + "/recipe.txt"), "recipe");
  // Files of somebody else are no training; an empty folder may become one.
  std::filesystem::remove(folder + "/recipe.txt");
  EXPECT_EQ(BeginTrainingFolder(folder, "recipe").code(), absl::StatusCode::kFailedPrecondition);
  std::filesystem::remove(folder + "/samples.bin");
  EXPECT_TRUE(BeginTrainingFolder(folder, "another").ok());
  EXPECT_EQ(ReadBytes(folder + "/recipe.txt"), "another");
}

TEST(TrainingFolder, TheNetIsReadAsTheTrainerLeftIt) {
  const TempFolder folder;
  v1::AvatarNetTraining training;
  const auto read = [&] { return ReadTrainedNet(folder.path(), {.level = 2, .gutter = 5}, &training); };
  EXPECT_THAT(std::string(read().status().message()), HasSubstr("training.json"));
  v1::AvatarNetTraining written;
  written.set_steps(77);
  ASSERT_TRUE(WriteJsonFile(folder / "training.json", written).ok());
  EXPECT_THAT(std::string(read().status().message()), HasSubstr("net.onnx"));
  const AvatarNet shift = ShiftNet();
  WriteBytes(folder / "net.onnx", shift.onnx);
  EXPECT_THAT(std::string(read().status().message()), HasSubstr("sample.bin"));
  WriteBytes(folder / "sample.bin", "no sample");
  EXPECT_THAT(std::string(read().status().message()), HasSubstr("sample.bin: holds no sample"));
  WriteBytes(folder / "sample.bin", EncodeNetSample(shift));
  const auto net = read();
  ASSERT_TRUE(net.ok()) << net.status();
  EXPECT_EQ(training.steps(), 77);
  EXPECT_EQ(net->onnx, shift.onnx);
  EXPECT_EQ(net->atlas.level, 2);
  EXPECT_EQ(net->atlas.gutter, 5);
  EXPECT_EQ(net->sample.values, shift.sample.values);
  EXPECT_EQ(net->sample_answer.values, shift.sample_answer.values);
}

}  // namespace
}  // namespace weft
