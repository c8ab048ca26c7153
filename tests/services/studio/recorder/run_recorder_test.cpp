// Recorders of replayed takes, in this process.
#include "services/studio/recorder/run_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/studio/recorder/recorder_files.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"
#include "weft/v1/recorder.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class RunRecorderTest : public ::testing::Test {
 protected:
  RunRecorderTest() {
    PatternFrames frames({"left", "right"}, 64, 48);
    RecordPattern(temp_ / "replayed", frames);
    fs::create_directories(folder_);
    request_.set_no_disk_test(true);
    v1::Session& session = *request_.mutable_session();
    session.set_fps(30);
    for (const char* id : {"left", "right"}) {
      v1::SessionCamera& camera = *session.add_cameras();
      camera.set_id(id);
      camera.mutable_replay()->set_take(temp_ / "replayed");
    }
  }
  absl::Status Run() {
    EXPECT_TRUE(WriteJsonFile(files_.request, request_).ok());
    return RunRecorder(folder_, stop_);
  }
  v1::RecorderState State() const {
    v1::RecorderState state;
    EXPECT_TRUE(ReadJsonFile(files_.state, state).ok());
    return state;
  }

  const TempFolder temp_;
  const std::string folder_ = temp_ / "recorder";
  const RecorderFiles files_{folder_};
  v1::RecorderRequest request_;
  std::atomic<bool> stop_ = false;
};

TEST_F(RunRecorderTest, RecordsUntilItsCamerasHaveEnded) {
  const absl::Status status = Run();
  ASSERT_TRUE(status.ok()) << status;
  const v1::RecorderState state = State();
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_ENDED);
  EXPECT_EQ(state.message(), "");
  EXPECT_EQ(state.error_code(), "");
  // A machine with other things to do may drop sets.
  const v1::Take take = ReadTakeFile(files_.take).value();
  EXPECT_GT(state.sets_recorded(), 0u);
  EXPECT_EQ(state.sets_recorded(), take.sets_recorded());
  EXPECT_EQ(state.sets_dropped(), take.sets_dropped());
  EXPECT_EQ(state.frames_missing(), take.frames_missing());
  EXPECT_GT(state.updated_unix_ns(), 0);
  ASSERT_EQ(state.cameras_size(), 2);
  EXPECT_EQ(state.cameras(0).id(), "left");
  EXPECT_EQ(state.cameras(1).id(), "right");
  EXPECT_FALSE(fs::exists(files_.room));
  EXPECT_FALSE(fs::exists(files_.state + ".next"));
}

TEST_F(RunRecorderTest, EndsWhenItIsStopped) {
  stop_ = true;
  ASSERT_TRUE(Run().ok());
  EXPECT_EQ(State().phase(), v1::RECORDER_PHASE_ENDED);
}

TEST_F(RunRecorderTest, SaysInItsStateWhyItFailed) {
  request_.mutable_session()->mutable_cameras(1)->mutable_replay()->set_take(temp_ / "nothing");
  const absl::Status status = Run();
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
  const v1::RecorderState state = State();
  EXPECT_EQ(state.phase(), v1::RECORDER_PHASE_FAILED);
  EXPECT_EQ(state.error_code(), "NOT_FOUND");
  EXPECT_EQ(state.message(), status.message());
  EXPECT_THAT(state.message(), HasSubstr("camera right: "));
  EXPECT_EQ(state.disk_minutes_left(), -1);
  EXPECT_FALSE(fs::exists(files_.room));
  EXPECT_FALSE(fs::exists(files_.take));
}

TEST_F(RunRecorderTest, FailsWithoutARequest) {
  EXPECT_TRUE(absl::IsNotFound(RunRecorder(folder_, stop_)));
  EXPECT_EQ(State().phase(), v1::RECORDER_PHASE_FAILED);
}

TEST_F(RunRecorderTest, TriesTheDiskUnlessItIsToldNotTo) {
  request_.mutable_session()->set_low_disk_gib(1e6);
  request_.set_no_disk_test(false);
  const absl::Status status = Run();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(State().message(), HasSubstr("no_disk_test records all the same"));
  EXPECT_EQ(State().error_code(), "FAILED_PRECONDITION");
  EXPECT_FALSE(fs::exists(files_.take));
}

}  // namespace
}  // namespace weft
