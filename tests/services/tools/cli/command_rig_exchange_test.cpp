#include "services/tools/cli/commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/rig_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Cameras a, b and c; number k has the focal length 1000 + k, stands at x = 100 k, and its sigmas are 1 + 10
// k.
Rig NumberedRig() {
  Rig rig;
  for (int k = 0; k < 3; ++k) {
    CameraModel& camera = rig.cameras.emplace_back();
    camera.id = std::string(1, static_cast<char>('a' + k));
    camera.width_px = 640, camera.height_px = 480;
    camera.fx_px = camera.fy_px = 1000 + k;
    camera.cx_px = 320, camera.cy_px = 240;
    camera.translation_mm = {100.0 * k, 0, 2000};
  }
  return rig;
}

CalibrationRecord NumberedRecord() {
  CalibrationRecord record;
  record.version = 4;
  for (int k = 0; k < 3; ++k) record.cameras.emplace_back().sigmas.fill(1 + 10 * k);
  return record;
}

class CommandRigExchange : public ::testing::Test {
 protected:
  CommandRigExchange() {
    const CalibrationRecord record = NumberedRecord();
    EXPECT_TRUE(WriteRig(rig_file_, NumberedRig(), "", &record).ok());
  }
  CommandRun Exchange(std::vector<std::string> words) const {
    words.insert(words.begin(), {"exchange", rig_file_});
    words.insert(words.end(), {"--out", out_});
    return RunCommand(AddRigExchangeCommand, std::move(words));
  }

  const TempFolder folder_;
  const std::string rig_file_ = folder_ / "rig.json", out_ = folder_ / "out.json";
};

TEST_F(CommandRigExchange, EachCameraGetsTheModelOfTheNextAndTheLastThatOfTheFirst) {
  const CommandRun run = Exchange({"a", "c", "b"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const auto rig = ReadRig(out_);
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(run.out, out_ + ": cameras a, c, b exchanged, hash " + rig->ContentHash() + "\n");
  EXPECT_EQ(rig->cameras[0].id, "a");
  EXPECT_EQ(rig->cameras[0].fx_px, 1002);  // of c
  EXPECT_EQ(rig->cameras[2].fx_px, 1001);  // of b
  EXPECT_EQ(rig->cameras[1].fx_px, 1000);  // of a
  EXPECT_EQ(rig->cameras[1].translation_mm.x(), 0);
}

TEST_F(CommandRigExchange, SigmasGoWithThePartThatIsExchanged) {
  ASSERT_TRUE(Exchange({"a", "b", "--only", "place"}).status.ok());
  const auto rig = ReadRig(out_);
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->cameras[0].fx_px, 1000);
  EXPECT_EQ(rig->cameras[0].translation_mm.x(), 100);
  const auto record = ReadCalibrationRecord(out_);
  ASSERT_TRUE(record.ok() && record->has_value());
  // Nine of the lens stay, six of the place come from b.
  for (size_t i = 0; i < 15; ++i) {
    EXPECT_DOUBLE_EQ((*record)->cameras[0].sigmas[i], i < 9 ? 1 : 11) << i;
    EXPECT_DOUBLE_EQ((*record)->cameras[1].sigmas[i], i < 9 ? 11 : 1) << i;
    EXPECT_DOUBLE_EQ((*record)->cameras[2].sigmas[i], 21) << i;
  }
}

TEST_F(CommandRigExchange, TheNewRigKnowsWhichOneItReplaces) {
  ASSERT_TRUE(Exchange({"a", "b"}).status.ok());
  const auto record = ReadCalibrationRecord(out_);
  ASSERT_TRUE(record.ok() && record->has_value());
  EXPECT_EQ((*record)->version, 5);
  EXPECT_EQ((*record)->replaces, NumberedRig().ContentHash());
  EXPECT_THAT(ReadBytes(out_), HasSubstr(NumberedRig().ContentHash() + ") with cameras a, b exchanged"));
}

TEST_F(CommandRigExchange, NamesTheRigAndTheCameraThatItLacks) {
  const CommandRun run = Exchange({"a", "d"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(run.message(), AllOf(HasSubstr(rig_file_), HasSubstr("the rig has no camera d")));
  EXPECT_THAT(Exchange({"a"}).message(), HasSubstr("two or more are exchanged"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(CommandRigExchange, ARigThatIsThereStaysUnlessItIsForced) {
  WriteBytes(out_, "another rig");
  const CommandRun refused = Exchange({"a", "b"});
  EXPECT_EQ(refused.status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr(out_), HasSubstr("--force")));
  EXPECT_EQ(ReadBytes(out_), "another rig");
  EXPECT_TRUE(Exchange({"a", "b", "--force"}).status.ok());
  EXPECT_TRUE(ReadRig(out_).ok());
}

}  // namespace
}  // namespace weft
