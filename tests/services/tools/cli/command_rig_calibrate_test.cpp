// weft rig target, rehearse, calibrate.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/target_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "weft/v1/calibration.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class CommandRigCalibrate : public ::testing::Test {
 protected:
  CommandRigCalibrate() { unsetenv("WEFT_SERVER"); }
  static AloudRun Rig(std::vector<std::string> words) {
    return RunAloud(AddRigCalibrateCommands, std::move(words));
  }
  AloudRun Target(std::vector<std::string> more) const {
    std::vector<std::string> words = {"target", "--rows", "2", "--cols", "3", "--out", target_};
    words.insert(words.end(), more.begin(), more.end());
    return Rig(words);
  }

  const TempFolder folder_;
  const std::string target_ = folder_ / "target", file_ = target_ + "/target.json";
};

TEST_F(CommandRigCalibrate, ATargetHasBoardsOfTagsOfTheirOwnAndBars) {
  const AloudRun run = Target({"--tag-mm", "35", "--boards", "2", "--first-id", "7", "--bar", "500:501:1000",
                               "--bar", "502:503:250.5", "--id", "stage"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  std::string said = "target   " + file_ + "\n";
  for (const char* name :
       {"board_A", "board_B", "bar1_tag500", "bar1_tag501", "bar2_tag502", "bar2_tag503"}) {
    said += "print    " + target_ + "/" + name + ".pdf (and .svg), at true scale\n";
    EXPECT_TRUE(fs::exists(target_ + "/" + name + ".svg")) << name;
  }
  EXPECT_EQ(run.out, said);
  const auto target = ReadTarget(file_);
  ASSERT_TRUE(target.ok()) << target.status();
  EXPECT_EQ(target->id, "stage");
  ASSERT_EQ(target->boards.size(), 2u);
  EXPECT_EQ(target->boards[0].id, "A");
  EXPECT_EQ(target->boards[1].id, "B");
  EXPECT_THAT(target->boards[0].tag_ids, ElementsAre(7, 8, 9, 10, 11, 12));
  EXPECT_THAT(target->boards[1].tag_ids, ElementsAre(13, 14, 15, 16, 17, 18));
  EXPECT_EQ(target->boards[1].tag_mm, 35);
  EXPECT_EQ(target->boards[1].gap_mm, 8.75) << "a module of eight on each side";
  ASSERT_EQ(target->scale_bars.size(), 2u);
  EXPECT_EQ(target->scale_bars[1].id, "bar2");
  EXPECT_EQ(target->scale_bars[1].family, "tag36h11");
  EXPECT_EQ(target->scale_bars[1].first_tag, 502);
  EXPECT_EQ(target->scale_bars[1].second_tag, 503);
  EXPECT_EQ(target->scale_bars[1].length_mm, 250.5);
}

TEST_F(CommandRigCalibrate, GapsMayBeWider) {
  ASSERT_TRUE(Target({"--gap-mm", "20"}).status.ok());
  EXPECT_EQ(ReadTarget(file_)->boards[0].gap_mm, 20);
  EXPECT_EQ(ReadTarget(file_)->boards[0].tag_mm, 40);
  // tagStandard41h12: nine modules wide, a border of five.
  ASSERT_TRUE(Target({"--family", "tagStandard41h12", "--tag-mm", "50", "--force"}).status.ok());
  EXPECT_EQ(ReadTarget(file_)->boards[0].gap_mm, 40);
}

// Its prints may be glued to boards.
TEST_F(CommandRigCalibrate, ATargetIsReplacedByItselfOrByForce) {
  ASSERT_TRUE(Target({}).status.ok());
  EXPECT_TRUE(Target({}).status.ok());
  const AloudRun refused = Target({"--tag-mm", "41"});
  EXPECT_EQ(refused.status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(refused.message(), HasSubstr("a target, whose boards may be printed"));
  EXPECT_EQ(ReadTarget(file_)->boards[0].tag_mm, 40);
  EXPECT_TRUE(Target({"--tag-mm", "41", "--force"}).status.ok());
}

TEST_F(CommandRigCalibrate, WhatIsNoBarIsAnsweredWithOne) {
  for (const char* bar : {"500:501", "a:501:1000", "500:b:1000", "500:501:c", "500:501:1:2", ""}) {
    const AloudRun run = Target({"--bar", bar});
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument) << bar;
    if (*bar != '\0') {
      EXPECT_EQ(run.message(), std::string("--bar ") + bar +
                                   ": expected FIRST_TAG:SECOND_TAG:LENGTH_MM, such as 500:501:1000");
    }
  }
  EXPECT_FALSE(Target({"--family", "tagCircle"}).status.ok());
  EXPECT_FALSE(fs::exists(target_));
}

TEST_F(CommandRigCalibrate, ARehearsalHasPicturesAndTheRigThatTookThem) {
  ASSERT_TRUE(Target({}).status.ok());
  const std::string dump = folder_ / "boards";
  const AloudRun run =
      Rig({"rehearse", "--target", file_, "--cameras", "2", "--frames", "3", "--width-px", "96",
           "--height-px", "64", "--distance-mm", "1800", "--threads", "1", "--out", dump});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "dump     " + dump + "\ntruth    " + dump + "/truth/rig.json\n");
  EXPECT_TRUE(fs::exists(dump + "/0002/c01.png"));
  EXPECT_FALSE(fs::exists(dump + "/0003"));
  const auto rig = ReadRig(dump + "/truth/rig.json");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->cameras.size(), 2u);
  EXPECT_EQ(rig->cameras[0].width_px, 96);
  EXPECT_EQ(rig->cameras[0].height_px, 64);
  EXPECT_EQ(Rig({"rehearse", "--target", folder_ / "none", "--out", dump}).status.code(),
            absl::StatusCode::kNotFound);

  // Pictures of a few pixels show no tags: the calibration is refused, and its page says why.
  const std::string out = folder_ / "rig.json";
  const auto calibrate = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"calibrate", dump, "--target", file_, "--out", out});
    return Rig(more);
  };
  WriteBytes(dump + "/0001/c01.png", "no picture");
  const AloudRun refused = calibrate({});
  EXPECT_TRUE(IsVerdict(refused.status)) << refused.status;
  EXPECT_THAT(refused.out, StartsWith("bad: camera c00: "));
  EXPECT_THAT(refused.out, HasSubstr("\nCalibration refused for 2 reasons\nbesides  camera c01: "));
  EXPECT_THAT(refused.out, testing::EndsWith("\nrig      " + out + " was not written\nreport   " +
                                             (folder_ / "rig.report.html") + "\n"));
  EXPECT_THAT(refused.err, StartsWith("weft: warning: 1 images could not be read, the first: "));
  EXPECT_FALSE(fs::exists(out));
  const AloudRun json = calibrate({"--json", "--frames", "0:1"});
  EXPECT_TRUE(IsVerdict(json.status));
  EXPECT_EQ(FromJson<v1::CalibrationReport>(json.out).verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(json.err, "");
  EXPECT_EQ(calibrate({"--target", folder_ / "none"}).status.code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
