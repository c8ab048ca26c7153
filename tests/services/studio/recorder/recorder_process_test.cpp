#include "services/studio/recorder/recorder_process.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/studio/recorder/recorder_files.h"
#include "tests/capture/file_size_limit.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class RecorderProcessTest : public ::testing::Test {
 protected:
  RecorderProcessTest() {
    fs::create_directories(folder_);
    v1::SessionCamera& camera = *request_.mutable_session()->add_cameras();
    camera.set_id("left");
    camera.mutable_replay()->set_take("/take");
  }
  // A recorder that is a script of a shell.
  absl::Status Start(const std::string& script) {
    const std::string program = temp_ / "program";
    WriteBytes(program, "#!/bin/sh\n" + script);
    fs::permissions(program, fs::perms::owner_all);
    return StartRecorder(program, folder_, request_);
  }
  void Put(v1::RecorderPhase phase, const std::string& message = "") {
    EXPECT_TRUE(WriteJsonFile(files_.request, request_).ok());
    v1::RecorderState state;
    state.set_phase(phase);
    state.set_message(message);
    EXPECT_TRUE(WriteJsonFile(files_.state, state).ok());
  }
  // That it was recorded, and not closed.
  void PutOpenTake() {
    PatternFrames frames({"left"}, 64, 48);
    RecordPattern(files_.take, frames);
    v1::Take take = ReadTakeFile(files_.take).value();
    take.set_state(v1::TAKE_STATE_RECORDING);
    EXPECT_TRUE(WriteTakeFile(files_.take, take).ok());
  }
  v1::RecorderState Recovered() {
    const auto view = RecoverIfDead(folder_);
    EXPECT_TRUE(view.ok()) << view.status();
    return view.ok() ? view->state : v1::RecorderState();
  }

  const TempFolder temp_;
  const std::string folder_ = temp_ / "recorder";
  const RecorderFiles files_{folder_};
  v1::RecorderRequest request_;
};

TEST_F(RecorderProcessTest, StartsAProgramOnTheRequest) {
  ASSERT_TRUE(Start("cp \"$1/request.json\" \"$1/copy.json\"\necho said\n").ok());
  v1::RecorderRequest request;
  ASSERT_TRUE(ReadJsonFile(folder_ + "/copy.json", request).ok());
  EXPECT_EQ(request.SerializeAsString(), request_.SerializeAsString());
  EXPECT_EQ(ReadBytes(files_.log), "said\n");
  EXPECT_EQ(fs::status(files_.log).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(RecorderProcessTest, LaterProgramsWriteToTheEndOfTheLog) {
  ASSERT_TRUE(Start("echo first\n").ok());
  ASSERT_TRUE(Start("echo second\necho third >&2\n").ok());
  EXPECT_EQ(ReadBytes(files_.log), "first\nsecond\nthird\n");
}

TEST_F(RecorderProcessTest, SaysWhyAProgramDidNotStart) {
  const absl::Status failed = Start("echo no camera >&2\nexit 3\n");
  EXPECT_TRUE(absl::IsInternal(failed));
  EXPECT_THAT(std::string(failed.message()),
              AllOf(HasSubstr("program: "), HasSubstr("3"), HasSubstr("; no camera")));
  const absl::Status missing = StartRecorder(temp_ / "none", folder_, request_);
  EXPECT_TRUE(absl::IsNotFound(missing));
  EXPECT_THAT(std::string(missing.message()), HasSubstr("none: no such program"));
}

TEST_F(RecorderProcessTest, RefusesRequestsBeforeAnythingIsWritten) {
  request_.set_seconds(-1);
  const absl::Status negative = Start("exit 0\n");
  EXPECT_TRUE(absl::IsInvalidArgument(negative));
  EXPECT_THAT(std::string(negative.message()), HasSubstr("seconds: is negative"));
  request_.set_seconds(0);
  request_.mutable_session()->clear_cameras();
  const absl::Status empty = Start("exit 0\n");
  EXPECT_EQ(empty.message(), "session: the field cameras is empty");
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(RecorderProcessTest, IsLookedAtByItsFiles) {
  EXPECT_TRUE(absl::IsNotFound(InspectRecorder(folder_).status()));
  EXPECT_TRUE(IsSettled(folder_)) << "none was started";
  ASSERT_TRUE(WriteJsonFile(files_.request, request_).ok());
  auto view = InspectRecorder(folder_);
  ASSERT_TRUE(view.ok()) << view.status();
  EXPECT_EQ(view->request.session().cameras(0).id(), "left");
  EXPECT_EQ(view->state.phase(), v1::RecorderState().phase());
  EXPECT_FALSE(view->lives);
  EXPECT_FALSE(IsSettled(folder_));
  Put(v1::RECORDER_PHASE_ENDED, "over");
  EXPECT_EQ(InspectRecorder(folder_)->state.message(), "over");
  EXPECT_TRUE(IsSettled(folder_));
  WriteBytes(files_.state, "{");
  EXPECT_FALSE(InspectRecorder(folder_).ok());
  EXPECT_FALSE(IsSettled(folder_));
}

// The lock says that it lives, and its number where the signal goes.
TEST_F(RecorderProcessTest, IsStoppedByASignal) {
  EXPECT_TRUE(StopRecorder(folder_).ok()) << "there is none";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (;;) pause();
  }
  WriteBytes(files_.lock, std::to_string(child) + "\n");
  Put(v1::RECORDER_PHASE_RECORDING);
  EXPECT_TRUE(StopRecorder(folder_).ok()) << "nobody holds the lock";
  EXPECT_EQ(waitpid(child, nullptr, WNOHANG), 0);
  const UniqueFd lock(open(files_.lock.c_str(), O_RDONLY | O_CLOEXEC));
  ASSERT_EQ(flock(lock.get(), LOCK_EX), 0);
  EXPECT_TRUE(InspectRecorder(folder_)->lives);
  EXPECT_TRUE(IsSettled(folder_));
  EXPECT_EQ(Recovered().phase(), v1::RECORDER_PHASE_RECORDING) << "it lives";
  EXPECT_TRUE(StopRecorder(folder_).ok());
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGTERM);
  for (const char* text : {"1", "0", "-5", "none", ""}) {
    WriteBytes(files_.lock, text);
    EXPECT_FALSE(InspectRecorder(folder_)->lives) << text;
  }
}

TEST_F(RecorderProcessTest, TheTakeOfOneThatDiedIsRecovered) {
  PutOpenTake();
  Put(v1::RECORDER_PHASE_RECORDING);
  WriteBytes(files_.room, "...");
  EXPECT_FALSE(IsSettled(folder_));
  const v1::RecorderState state = Recovered();
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_RECOVERED);
  EXPECT_EQ(state.message(), "the recorder ended abnormally; what it had acknowledged was recovered");
  EXPECT_GT(state.updated_unix_ns(), 0);
  EXPECT_EQ(ReadTakeFile(files_.take)->state(), v1::TAKE_STATE_RECOVERED);
  EXPECT_FALSE(fs::exists(files_.room));
  EXPECT_TRUE(IsSettled(folder_));
  EXPECT_EQ(InspectRecorder(folder_)->state.message(), state.message());
}

TEST_F(RecorderProcessTest, OneThatFailedKeepsItsReason) {
  PutOpenTake();
  Put(v1::RECORDER_PHASE_FAILED, "disk full");
  EXPECT_FALSE(IsSettled(folder_));
  EXPECT_EQ(Recovered().message(),
            "disk full; the take was left open, and what it had acknowledged was recovered");
}

TEST_F(RecorderProcessTest, OneThatClosedItsTakeIsLeftAlone) {
  PatternFrames frames({"left"}, 64, 48);
  RecordPattern(files_.take, frames);
  v1::Take take = ReadTakeFile(files_.take).value();
  take.set_state(v1::TAKE_STATE_STOPPED);
  EXPECT_TRUE(WriteTakeFile(files_.take, take).ok());
  for (const v1::RecorderPhase phase :
       {v1::RECORDER_PHASE_FAILED, v1::RECORDER_PHASE_ENDED, v1::RECORDER_PHASE_RECOVERED}) {
    Put(phase, "over");
    EXPECT_TRUE(IsSettled(folder_));
    EXPECT_EQ(Recovered().message(), "over");
  }
  EXPECT_EQ(ReadTakeFile(files_.take)->state(), v1::TAKE_STATE_STOPPED);
  // It died before it could say so.
  Put(v1::RECORDER_PHASE_RECORDING);
  EXPECT_EQ(Recovered().phase(), v1::RECORDER_PHASE_RECOVERED);
  EXPECT_EQ(ReadTakeFile(files_.take)->state(), v1::TAKE_STATE_STOPPED);
}

TEST_F(RecorderProcessTest, OneThatRecordedNothingSaysSo) {
  Put(v1::RECORDER_PHASE_STARTING);
  EXPECT_EQ(Recovered().message(), "the recorder ended abnormally, before it recorded anything");
  EXPECT_EQ(Recovered().phase(), v1::RECORDER_PHASE_RECOVERED);
}

// As on a full disk: the take may be looked at all the same, and is tried again.
TEST_F(RecorderProcessTest, ATakeThatCannotBeRecoveredIsTriedAgain) {
  PutOpenTake();
  Put(v1::RECORDER_PHASE_RECORDING);
  const auto on_full_disk = [this] {
    const FileSizeLimit limit(1);
    return Recovered();
  };
  const v1::RecorderState state = on_full_disk();
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_FAILED);
  EXPECT_THAT(state.message(),
              AllOf(HasSubstr("the recorder ended abnormally; the take cannot be recovered yet: "),
                    HasSubstr("; it is tried again whenever somebody looks")));
  EXPECT_FALSE(IsSettled(folder_));
  EXPECT_EQ(InspectRecorder(folder_)->state.phase(), v1::RECORDER_PHASE_RECORDING) << "nothing was written";
  // One that has said why keeps its reason.
  Put(v1::RECORDER_PHASE_FAILED, "disk full");
  EXPECT_EQ(on_full_disk().message(), "disk full");
  EXPECT_EQ(on_full_disk().phase(), v1::RECORDER_PHASE_FAILED);
  EXPECT_THAT(Recovered().message(), HasSubstr("disk full; the take was left open, and what it had"));
}

}  // namespace
}  // namespace weft
