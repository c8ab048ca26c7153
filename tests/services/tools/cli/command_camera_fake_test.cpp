// weft camera fake: what it refuses before a camera runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CommandCameraFake : public ::testing::Test {
 protected:
  // Never runs a camera: the address is none.
  CommandRun Fake(std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"fake", "--address", "camera", "--session", session_};
    words.insert(words.end(), more.begin(), more.end());
    return RunCommand(AddCameraFakeCommand, words);
  }

  const TempFolder folder_;
  const std::string session_ = folder_ / "session.json";
};

TEST_F(CommandCameraFake, AnAddressThatIsNoneIsAnsweredWithOneThatIs) {
  const CommandRun run = Fake();
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(run.message(), HasSubstr("--address \"camera\" is no IPv4 address; try 127.0.0.2"));
  EXPECT_FALSE(std::filesystem::exists(session_));
}

// It is made again as easily as before.
TEST_F(CommandCameraFake, ASessionOfCamerasWithoutHardwareMayBeReplaced) {
  WriteBytes(session_, R"({"cameras": [{"id": "c01", "gige": {"device": "127.0.0.2"}}]})");
  EXPECT_THAT(Fake().message(), HasSubstr("is no IPv4 address"));
}

TEST_F(CommandCameraFake, ASessionOfOtherCamerasStays) {
  for (
      const char* text :
      {R"({"cameras": [{"id": "c01", "gige": {"device": "192.168.1.7"}}]})",
       R"({"cameras": [{"id": "c01", "gige": {"device": "127.0.0.2"}}, {"id": "c02", "gige": {"device": "SN 7"}}]})",
       R"({"cameras": []})", "no session"}) {
    WriteBytes(session_, text);
    const CommandRun run = Fake();
    EXPECT_EQ(run.status.code(), absl::StatusCode::kAlreadyExists) << text;
    EXPECT_THAT(run.message(), AllOf(HasSubstr(session_), HasSubstr("a session of other cameras"))) << text;
    EXPECT_EQ(ReadBytes(session_), text);
    EXPECT_THAT(Fake({"--force"}).message(), HasSubstr("is no IPv4 address")) << text;
  }
}

TEST_F(CommandCameraFake, TheFolderOfTheSessionMustBeThere) {
  const CommandRun run = RunCommand(
      AddCameraFakeCommand, {"fake", "--address", "camera", "--session", folder_ / "none/session.json"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(run.message(), HasSubstr(folder_ / "none"));
}

TEST_F(CommandCameraFake, PicturesNeedTheRigOfTheirDump) {
  std::filesystem::create_directories(folder_ / "dump");
  const CommandRun run = Fake({"--pictures", folder_ / "dump"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(run.message(), HasSubstr(folder_ / "dump/rig.json"));
  EXPECT_THAT(Fake({"--cameras", "0"}).message(), HasSubstr("--cameras"));
}

}  // namespace
}  // namespace weft
