// weft camera fake.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/results/export/filmed_result.h"
#include "tests/services/tools/cli/run_command.h"
#include "weft/v1/session.pb.h"

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

// Cameras run until a signal, which is there before they are.
class RunningCameras : public ::testing::Test {
 protected:
  RunningCameras() {
    sigset_t term;
    sigemptyset(&term);
    sigaddset(&term, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &term, &before_);
  }
  ~RunningCameras() override { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  CommandRun Fake(std::vector<std::string> words) const {
    words.insert(words.begin(), {"fake", "--session", session_});
    pthread_kill(pthread_self(), SIGTERM);
    return RunCommand(AddCameraFakeCommand, words);
  }
  v1::Session Session() const {
    v1::Session session;
    EXPECT_TRUE(ReadJsonFile(session_, session).ok());
    return session;
  }

  sigset_t before_;
  const FilmedResult result_;
  const std::string session_ = result_.folder / "session.json";
};

TEST_F(RunningCameras, AreInASessionThatARecordingReads) {
  const CommandRun run = Fake({"--cameras", "3", "--address", "127.71.0.254", "--fps", "12.5"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out,
            "3 GigE Vision cameras film at 127.71.0.254 to 127.71.1.0 until Ctrl-C. In another terminal:\n"
            "  weft take record --session " +
                session_ + " --out TAKE --seconds 5\n");
  EXPECT_EQ(
      Session().ShortDebugString(),
      "cameras { id: \"c01\" gige { device: \"127.71.0.254\" } } cameras { id: \"c02\" gige { device: "
      "\"127.71.0.255\" } } cameras { id: \"c03\" gige { device: \"127.71.1.0\" } } fps: 12.5 ptp: true");
}

TEST_F(RunningCameras, OfADumpAreThoseOfItsRig) {
  const CommandRun run =
      Fake({"--pictures", result_.recording.dump, "--rig", result_.recording.rig, "--address", "127.71.2.1"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const v1::Session session = Session();
  ASSERT_EQ(session.cameras_size(), 2);
  EXPECT_EQ(session.cameras(0).id(), "c1");
  EXPECT_EQ(session.cameras(1).id(), "c2");
  EXPECT_EQ(session.cameras(1).gige().device(), "127.71.2.2");
  EXPECT_EQ(session.fps(), 10);
}

TEST_F(RunningCameras, AnAddressOfAnotherMachineIsRefused) {
  const CommandRun run = Fake({"--address", "192.0.2.1"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(run.message(), HasSubstr("port 3956 of 192.0.2.1 cannot be had"));
  EXPECT_FALSE(std::filesystem::exists(session_));
  int signal = 0;  // nobody waited for it
  sigset_t term;
  sigemptyset(&term);
  sigaddset(&term, SIGTERM);
  sigwait(&term, &signal);
}

}  // namespace
}  // namespace weft
