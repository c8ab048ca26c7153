#include "services/work/animation/drive_live.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/work/animation/driver_memory.h"
#include "tests/services/work/animation/driven_take.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A recording that is replayed slowly enough for every frame.
class DriveLiveTest : public DrivenTakeTest {
 protected:
  DriveLiveTest() {
    request_.spec = SpecOf(driven_take->take);
    request_.spec.set_out(out_);
    request_.spec.mutable_driving()->set_fps(20);
    request_.speed = 0.02;  // 2.5 s from frame to frame
    request_.threads = 2;
  }
  absl::StatusOr<v1::Job> Live() {
    told_.clear();
    return DriveLive(
        request_,
        [this](const v1::LiveDriving& now, const v1::FrameInfo& info) {
          told_.push_back(info.frame() + " " + std::to_string(now.frames_arrived()));
        },
        stop_.get_token());
  }

  LiveDriveRequest request_;
  std::vector<std::string> told_;
  std::stop_source stop_;
};

TEST_F(DriveLiveTest, GoesOnAfterTheLastFrameThatHasAResult) {
  request_.spec.set_end_frame(1);
  const auto job = Live();
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_THAT(told_, ElementsAre("0000 1"));
  EXPECT_EQ(job->state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job->frames().done(), 1);
  EXPECT_EQ(job->driven().live().frames_arrived(), 1);
  EXPECT_EQ(job->driven().live().frames_passed_over(), 0);
  EXPECT_GT(job->driven().live().latency_median_ms(), 0);
  EXPECT_EQ(job->driven().live().latency_p95_ms(), job->driven().live().latency_median_ms());
  EXPECT_EQ(job->driven().cameras_size(), kCameras);
  v1::Job written;
  ASSERT_TRUE(ReadJsonFile(out_ + "/job.json", written).ok());
  EXPECT_EQ(written.id(), job->id());
  EXPECT_EQ(written.driven().live().frames_arrived(), 1);
  EXPECT_TRUE(fs::exists(out_ + "/report.html"));
  EXPECT_TRUE(Mesh(out_, "0000") == Mesh(driven_take->out, "0000"));
  request_.spec.set_end_frame(2);
  const auto more = Live();
  ASSERT_TRUE(more.ok()) << more.status();
  EXPECT_THAT(told_, ElementsAre("0001 1"));
  EXPECT_EQ(more->frames().done(), 2);
  EXPECT_EQ(more->frames().reused(), 1);
  EXPECT_EQ(ReportOf(out_, "0001").driven().follows(),
            MemoryChecksum(ReportOf(out_, "0000").driven().memory()));
  const auto none = Live();
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_THAT(told_, IsEmpty());
  EXPECT_EQ(none->frames().reused(), 2);
}

TEST_F(DriveLiveTest, AFastReplayPassesOverFrames) {
  request_.speed = 1e6;
  const auto job = Live();
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->driven().live().frames_arrived(), 3);
  EXPECT_EQ(job->driven().live().frames_passed_over() + job->frames().total(), 3);
  EXPECT_GE(job->driven().live().frames_passed_over(), 1);
  EXPECT_TRUE(fs::exists(out_ + "/0002/mesh.ply")) << "the newest";
}

TEST_F(DriveLiveTest, ResultsOfAnotherRunAreNotGoneOnWith) {
  BeginWithAll();
  const absl::Status status = Live().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("holds frame 0000 of another run"), HasSubstr("without --live")));
}

TEST_F(DriveLiveTest, StoppedEndsWell) {
  stop_.request_stop();
  const auto job = Live();
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->frames().total(), 0);
  EXPECT_FALSE(fs::exists(out_ + "/0000"));
  EXPECT_TRUE(fs::exists(out_ + "/job.json"));
}

TEST_F(DriveLiveTest, OptionsThatDoNotGoTogetherAreRefused) {
  request_.speed = 0;
  EXPECT_THAT(std::string(Live().status().message()), HasSubstr("--speed must be positive"));
  request_.speed = 2;
  request_.session_file = root_ + "/session.json";
  EXPECT_THAT(std::string(Live().status().message()), HasSubstr("it is for recordings"));
  request_.speed = 1;
  request_.spec.set_first_frame(1);
  EXPECT_THAT(std::string(Live().status().message()), HasSubstr("still to come"));
  request_.spec.set_first_frame(0);
  request_.spec.set_out(driven_take->take + "/out");
  EXPECT_THAT(std::string(Live().status().message()), HasSubstr("lies in the folder of"));
}

TEST(LiveDrivingText, IsOneLine) {
  v1::LiveDriving live;
  live.set_latency_median_ms(91.6), live.set_latency_p95_ms(141.2), live.set_frames_per_s(11.42);
  live.set_frames_passed_over(60), live.set_frames_arrived(180);
  EXPECT_EQ(LiveDrivingText(live),
            "latency 92 ms (median), 141 ms (95 %), 11.4 frames/s, 60 of 180 passed over");
}

TEST_F(DriveLiveTest, TellsWhatTheJobIs) {
  request_.spec.set_end_frame(1);
  const auto job = Live();
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_TRUE(job->id().starts_with("local-"));
  EXPECT_EQ(job->spec().out(), out_);
  EXPECT_EQ(job->driven().avatar(), driven_take->avatar);
  EXPECT_EQ(job->first_frame(), "0000");
  EXPECT_EQ(job->last_frame(), "0000");
  EXPECT_GT(job->started_unix_ns(), 0);
  EXPECT_EQ(job->frames().total(), 1);
  EXPECT_EQ(job->frames().reused(), 0);
  EXPECT_TRUE(job->has_verdict());
  EXPECT_GT(job->driven().live().frames_per_s(), 0);
  v1::FrameReport report = ReportOf(out_, "0000");
  EXPECT_EQ(report.driven().follows(), MemoryChecksum(""));
  // Another avatar, or the same at another rate, is another run.
  request_.spec.mutable_driving()->set_fps(21);
  EXPECT_EQ(Live().status().message(),
            out_ +
                ": holds frame 0000 of another run, after which this one cannot go on; choose "
                "another folder, or drive without --live, which drives every frame anew");
}

TEST_F(DriveLiveTest, EachRefusalSaysWhatToChange) {
  request_.speed = -1;
  EXPECT_EQ(Live().status(), absl::InvalidArgumentError("--speed must be positive"));
  request_.speed = 1;
  request_.session_file = root_ + "/session.json";
  for (const int field : {0, 1, 2}) {
    request_.spec.set_frames(field == 0 ? "0001" : "");
    request_.spec.set_first_frame(field == 1 ? 1 : 0);
    request_.spec.set_end_frame(field == 2 ? 1 : 0);
    EXPECT_EQ(Live().status(),
              absl::InvalidArgumentError("--frames: frames that are still to come cannot be chosen"))
        << field;
  }
  request_.spec.set_end_frame(0);
  request_.speed = 2;
  EXPECT_EQ(Live().status(),
            absl::InvalidArgumentError("--speed: cameras film as fast as they do; it is for recordings"));
}

}  // namespace
}  // namespace weft
