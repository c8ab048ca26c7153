#include "services/server/daemon/program/drain.h"

#include <atomic>

#include "services/server/rpc/error_detail.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "tests/services/server/daemon/raw_call.h"
#include "tests/services/server/daemon/wait_until.h"
#include "weft/v1/operations.grpc.pb.h"
#include "weft/v1/server.grpc.pb.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class DrainTest : public DaemonTest {
 protected:
  DrainTest() {
    options_.on_drained = [this] { ++drained_; };
  }
  v1::DrainProgress Drain(bool finish_jobs) {
    v1::DrainRequest request;
    request.set_finish_jobs(finish_jobs);
    grpc::ClientContext context;
    v1::DrainProgress progress;
    const grpc::Status status = v1::Server::NewStub(client_->channel())->Drain(&context, request, &progress);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return progress;
  }

  const CapturedLog log_;
  std::atomic<int> drained_ = 0;
};

TEST_F(DrainTest, WaitsForTheFramesThatRunAndTakesNothingNew) {
  StartDaemon();
  const std::string id = Submit({"hang", "a"});
  WatchUntilRunning(id);
  EXPECT_EQ(Drain(false).ShortDebugString(), "tasks_running: 1 frames_running: 1 jobs_unfinished: 1");
  const absl::Status refused = client_->Submit(MakeRequest({"a"}, "later")).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(
      refused.message(),
      "daemon: takes no new work: it is about to stop, for example for an update; try again in a minute; "
      "what was submitted goes on when it is back");
  ASSERT_TRUE(DetailOf(refused));
  EXPECT_EQ(DetailOf(refused)->field(), "daemon");
  v1::StartTakeRequest take;
  take.set_idempotency_key("0123-take");
  v1::SessionCamera& camera = *take.mutable_recording()->mutable_session()->add_cameras();
  camera.set_id("left");
  camera.mutable_gige()->set_device("127.0.0.2");
  v1::StartOperationRequest operation;
  operation.set_idempotency_key("0123-operation");
  operation.mutable_spec()->set_command("take verify");
  v1::OperationInput& input = *operation.mutable_spec()->add_inputs();
  input.set_name("take");
  input.set_value(folder_ / "shirt");
  v1::RecordedTake recorded;
  v1::Operation started;
  grpc::ClientContext of_take, of_operation;
  EXPECT_EQ(v1::Takes::Stub(client_->channel()).StartTake(&of_take, take, &recorded).error_message(),
            refused.message());
  EXPECT_EQ(v1::Operations::Stub(client_->channel())
                .StartOperation(&of_operation, operation, &started)
                .error_message(),
            refused.message());
  ASSERT_TRUE(
      WaitUntil([this] { return log_.Count("error does not serve: daemon: takes no new work") == 1; }));
  EXPECT_EQ(AskHealth(daemon_->address(), ""), "NOT_SERVING");
  EXPECT_EQ(drained_, 0);
  EXPECT_FALSE(Drain(false).drained());
  ASSERT_TRUE(client_->Cancel(id).ok());
  ASSERT_TRUE(WaitUntil([this] { return drained_ > 0; }));
  EXPECT_EQ(Drain(false).ShortDebugString(), "drained: true");
  EXPECT_EQ(log_.Count("info draining: no new jobs, takes and operations; the frames that workers are at end "
                       "first"),
            1);
  EXPECT_EQ(log_.Count("info drained"), 1);
  daemon_.reset();
  EXPECT_EQ(drained_, 1) << "once";
}

TEST_F(DrainTest, LeavesFramesThatWaitToTheNextDaemonOrFinishesThem) {
  StartDaemon();
  const std::string id = Submit({"slow1", "slow2", "slow3", "slow4"});
  WatchUntilRunning(id);
  Drain(false);
  ASSERT_TRUE(WaitUntil([this] { return drained_ == 1; }));
  EXPECT_EQ(Drain(false).jobs_unfinished(), 1);
  EXPECT_LT(client_->Get(id)->frames().done(), 4);
  daemon_.reset();
  StartDaemon();
  Drain(true);
  ASSERT_TRUE(WaitUntil([this] { return drained_ == 2; }));
  EXPECT_EQ(client_->Get(id)->state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(log_.Count("info draining: no new jobs, takes and operations; the jobs end first"), 1);
}

TEST_F(DrainTest, EndsWithTheDaemonWithoutAWord) {
  StartDaemon();
  WatchUntilRunning(Submit({"hang"}));
  Drain(true);
  daemon_.reset();
  EXPECT_EQ(drained_, 0);
  EXPECT_EQ(log_.Count("drained"), 0);
}

}  // namespace
}  // namespace weft
