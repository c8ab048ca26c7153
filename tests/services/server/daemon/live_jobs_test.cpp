// Jobs that follow a take while it is being recorded.
#include <map>

#include "absl/strings/str_split.h"
#include "base/host_clock.h"
#include "capture/take/take_writer.h"
#include "services/server/rpc/error_detail.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class LiveJobTest : public DaemonTest {
 protected:
  LiveJobTest() {
    options_.load_inputs = [](const v1::RegistrationSpec&) { return LoadedInputs{{"0000"}, {}, {}}; };
    auto writer = TakeWriter::Create(folder_ / "take", {"cam1"}, {});
    EXPECT_TRUE(writer.ok()) << writer.status();
    writer_ = *std::move(writer);
  }

  void Record(int count) {
    for (int i = 0; i < count; ++i, ++sets_) {
      RawFrameSet set;
      set.number = sets_;
      set.missing = {{"cam1", "no light"}};
      ASSERT_TRUE(writer_->Append(0, set).ok());
      ASSERT_TRUE(writer_->Commit(sets_, EntriesOfRecorded(set, HostTime_ns())).ok());
    }
  }
  void CloseTake() { ASSERT_TRUE(writer_->Close(sets_ - 1, {}, {}).ok()); }

  v1::SubmitJobRequest LiveRequest(int every) {
    v1::SubmitJobRequest request = MakeRequest({});
    request.mutable_spec()->set_dump(folder_ / "take");
    request.mutable_spec()->set_live_every(every);
    return request;
  }

  void WaitUntilDone(const std::string& job_id, int frames) {
    WatchUntil(job_id,
               [frames](const v1::JobUpdate& update) { return update.job().frames().done() >= frames; });
  }

  // How often each frame was computed.
  std::map<std::string, int> Computed() {
    std::map<std::string, int> count_of;
    const std::vector<std::string> log =
        absl::StrSplit(ReadBytes(folder_ / "out/log"), '\n', absl::SkipEmpty());
    for (const std::string& frame : log) ++count_of[frame];
    return count_of;
  }

  std::unique_ptr<TakeWriter> writer_;
  uint64_t sets_ = 0;
};

TEST_F(LiveJobTest, RegistersSomeFramesWhileTheTakeRunsAndAllAfterwards) {
  StartDaemon();
  Record(5);
  const auto submitted = client_->Submit(LiveRequest(2));
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  WaitUntilDone(submitted->id(), 3);
  EXPECT_EQ(Computed(), (std::map<std::string, int>{{"0000", 1}, {"0002", 1}, {"0004", 1}}));
  Record(4);
  WaitUntilDone(submitted->id(), 5);
  const absl::StatusOr<v1::Job> live = client_->Get(submitted->id());
  EXPECT_EQ(live->state(), v1::JOB_STATE_RUNNING);
  EXPECT_TRUE(live->live().following());
  EXPECT_EQ(live->live().sets_recorded(), 9);
  EXPECT_EQ(live->live().backlog(), 0);
  EXPECT_GT(live->live().latency_s(), 0);
  EXPECT_EQ(live->live().coverage(), 0.5);
  EXPECT_EQ(live->frames().waiting(), 4);

  CloseTake();
  const v1::Job job = WaitForEnd(submitted->id());
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.message();
  EXPECT_EQ(job.frames().done(), 9);
  EXPECT_FALSE(job.live().following());
  EXPECT_EQ(job.last_frame(), "0008");
  // The worker of this test computes each time; weft-worker keeps what stands.
  EXPECT_EQ(Computed()["0002"], 2);
  EXPECT_EQ(Computed()["0003"], 1);
  for (const v1::FrameInfo& frame : Frames(submitted->id()))
    EXPECT_EQ(frame.latency_s() > 0, std::stoi(frame.frame()) % 2 == 0) << frame.frame();
}

TEST_F(LiveJobTest, GoesOnAfterARestartAlsoWhereTheTakeEndedMeanwhile) {
  StartDaemon();
  Record(3);
  const auto submitted = client_->Submit(LiveRequest(1));
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  const std::string id = submitted->id();
  WaitUntilDone(id, 3);
  daemon_.reset();
  Record(2);
  StartDaemon();
  WaitUntilDone(id, 5);
  daemon_.reset();
  Record(2);
  CloseTake();
  StartDaemon();
  const v1::Job job = WaitForEnd(id);
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.message();
  EXPECT_EQ(job.frames().done(), 7);
}

TEST_F(LiveJobTest, IsCancelledWhileItFollowsAndRetriedToTheEnd) {
  StartDaemon();
  Record(2);
  const std::string id = client_->Submit(LiveRequest(1))->id();
  WaitUntilDone(id, 2);
  Record(1);
  const absl::StatusOr<v1::Job> cancelled = client_->Cancel(id);
  ASSERT_TRUE(cancelled.ok()) << cancelled.status();
  EXPECT_EQ(cancelled->state(), v1::JOB_STATE_CANCELLED);
  Record(2);
  CloseTake();
  ASSERT_TRUE(client_->Retry(id).ok());
  const v1::Job job = WaitForEnd(id);
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.message();
  EXPECT_EQ(job.frames().done(), 5);
}

// Driven frames are not computed again, so that nothing but the end of the take ends their job.
TEST_F(LiveJobTest, DrivenFramesThatAreDoneBeforeTheTakeEndsEndTheirJob) {
  StartDaemon();
  Record(3);
  v1::SubmitJobRequest request = LiveRequest(1);
  request.mutable_spec()->mutable_driving()->set_avatar(folder_ / "shirt");
  const auto submitted = client_->Submit(request);
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  WatchUntil(submitted->id(), [](const v1::JobUpdate& update) {
    return update.job().frames().done() == 3 && update.job().usage().tasks() == 1;
  });
  CloseTake();
  const v1::Job job = WaitForEnd(submitted->id());
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.message();
  EXPECT_EQ(job.frames().done(), 3);
  EXPECT_EQ(Computed(), (std::map<std::string, int>{{"0000", 1}, {"0001", 1}, {"0002", 1}}));
}

TEST_F(LiveJobTest, FollowsOnlyTakesAndNoRanges) {
  StartDaemon();
  Record(1);
  v1::SubmitJobRequest request = LiveRequest(1);
  request.mutable_spec()->set_dump(folder_ / "shirt");
  EXPECT_EQ(client_->Submit(request).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(DetailOf(client_->Submit(request).status())->field(), "spec.live_every");
  request = LiveRequest(-1);
  EXPECT_EQ(client_->Submit(request).status().code(), absl::StatusCode::kInvalidArgument);
  request = LiveRequest(1);
  request.mutable_spec()->set_frames("0:3");
  EXPECT_THAT(std::string(client_->Submit(request).status().message()), HasSubstr("range of frames"));
}

}  // namespace
}  // namespace weft
