// What clients may do with each other's jobs and results.
#include <filesystem>
#include <fstream>
#include <future>

#include "tests/services/server/daemon/callers_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class DaemonOwnersTest : public CallersTest {
 protected:
  // A job of anna that has ended, with results in <folder>/<out>.
  std::string FinishedJobOfAnna(const std::string& out) {
    v1::Job job;
    const grpc::Status status = SubmitAs("anna", MakeRequest({"a", "b"}, out), &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(WaitForEnd(job.id()).state(), v1::JOB_STATE_DONE);
    return job.id();
  }
  // What a client that writes to <folder>/<out> is answered.
  grpc::Status WriteAs(const std::string& file, const std::string& out,
                       const std::vector<std::string>& frames = {"a", "b"}) {
    v1::SubmitJobRequest request = MakeRequest(frames, "request");
    request.mutable_spec()->set_out(folder_ / out);
    v1::Job job;
    grpc::Status status = SubmitAs(file, request, &job);
    if (status.ok()) WaitForEnd(job.id());
    return status;
  }
};

TEST_F(DaemonOwnersTest, OwnersAndOperatorsCancel) {
  StartDaemon();
  v1::Job first, second;
  ASSERT_TRUE(SubmitAs("anna", MakeRequest({"hang"}, "first"), &first).ok());
  ASSERT_TRUE(SubmitAs("anna", MakeRequest({"hang"}, "second"), &second).ok());
  const grpc::Status refused = CancelAs("ben", first.id());
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(refused.error_message(), HasSubstr("job " + first.id() + " belongs to token "));
  EXPECT_THAT(refused.error_message(), HasSubstr("(anna); ask its owner or an operator"));
  EXPECT_EQ(client_->Get(first.id())->state(), v1::JOB_STATE_RUNNING);
  EXPECT_TRUE(CancelAs("anna-too", first.id()).ok()) << "another token of the same name";
  EXPECT_TRUE(CancelAs("stage", second.id()).ok());
}

TEST_F(DaemonOwnersTest, OwnersAndOperatorsRetryAndMoveJobs) {
  StartDaemon();
  v1::Job job;
  ASSERT_TRUE(SubmitAs("anna", MakeRequest({"bad"}), &job).ok());
  EXPECT_EQ(WaitForEnd(job.id()).state(), v1::JOB_STATE_FAILED);
  v1::RetryJobRequest retry;
  retry.set_job_id(job.id());
  v1::SetJobPriorityRequest priority;
  priority.set_job_id(job.id());
  priority.set_priority(-1);
  const auto ben = JobsOf("ben"), anna = JobsOf("anna"), stage = JobsOf("stage");
  v1::Job answer;
  const auto set = [&](v1::Jobs::Stub& stub) {
    grpc::ClientContext context;
    return stub.SetJobPriority(&context, priority, &answer);
  };
  const auto again = [&](v1::Jobs::Stub& stub) {
    grpc::ClientContext context;
    return stub.RetryJob(&context, retry, &answer);
  };
  EXPECT_EQ(again(*ben).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(set(*ben).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(again(*anna).ok());
  EXPECT_TRUE(set(*anna).ok());
  priority.set_priority(11);
  const grpc::Status refused = set(*anna);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(refused.error_message(), HasSubstr("priority: 11 is for operators; give at most 10"));
  EXPECT_TRUE(set(*stage).ok());
}

TEST_F(DaemonOwnersTest, ResultsAreOverwrittenByTheirOwnersAndOperators) {
  StartDaemon();
  FinishedJobOfAnna("results");
  const grpc::Status refused = WriteAs("ben", "results");
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(refused.error_message(),
              HasSubstr("the results in " + (folder_ / "results") + " belongs to token"));
  // Other ways to the same files.
  std::filesystem::create_symlink(folder_ / "results", folder_ / "link");
  for (const char* out : {"results/", "link", "./results/../results", "results/a", "results/new/deeper"})
    EXPECT_EQ(WriteAs("ben", out).error_code(), grpc::StatusCode::PERMISSION_DENIED) << out;
  EXPECT_TRUE(WriteAs("anna-too", "results").ok());
  EXPECT_TRUE(WriteAs("stage", "results").ok());
  // Now they are the operator's.
  EXPECT_FALSE(WriteAs("anna", "results").ok());
}

TEST_F(DaemonOwnersTest, FramesDoNotTakeThePlaceOfSomebodysResults) {
  StartDaemon();
  std::filesystem::create_directories(folder_ / "shared");
  FinishedJobOfAnna("shared_take");
  std::filesystem::rename(folder_ / "shared_take", folder_ / "shared/a");
  EXPECT_EQ(WriteAs("ben", "shared", {"a"}).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(WriteAs("ben", "shared", {"c"}).ok());
}

TEST_F(DaemonOwnersTest, ResultsWithoutAnOwnerAreAnybodys) {
  StartDaemon();
  std::filesystem::create_directories(folder_ / "local");
  WriteBytes(folder_ / "local/job.json", R"({"id": "local", "state": "JOB_STATE_DONE"})");
  EXPECT_TRUE(WriteAs("ben", "local").ok());
}

TEST_F(DaemonOwnersTest, NobodyWritesBelowTheFolderOfAnotherJobThatRuns) {
  StartDaemon();
  v1::Job job;
  ASSERT_TRUE(SubmitAs("anna", MakeRequest({"hang"}, "running"), &job).ok());
  EXPECT_EQ(WriteAs("ben", "running/hang").error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_TRUE(CancelAs("anna", job.id()).ok());
}

TEST_F(DaemonOwnersTest, AKeyStandsForItsFirstCallersJob) {
  StartDaemon();
  v1::SubmitJobRequest request = MakeRequest({"a"});
  request.set_idempotency_key("0123-weft");
  v1::Job first, again;
  ASSERT_TRUE(SubmitAs("anna", request, &first).ok());
  ASSERT_TRUE(SubmitAs("anna-too", request, &again).ok());
  EXPECT_EQ(first.created_unix_ns(), again.created_unix_ns());
  for (const char* other : {"ben", "stage"}) {
    const grpc::Status refused = SubmitAs(other, request, &again);
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::ALREADY_EXISTS) << other;
    EXPECT_THAT(refused.error_message(), HasSubstr("idempotency_key: stands for a request of somebody else"));
  }
}

// Files of others with that name are no work for a daemon.
TEST_F(DaemonOwnersTest, ManyAndLargeJobFilesAreNotLookedThrough) {
  StartDaemon();
  const std::filesystem::path out = folder_ / "flood";
  std::vector<std::string> frames;
  for (int i = 0; i < 12; ++i) frames.push_back("f" + std::to_string(i));
  const auto write = [&](size_t count) {
    std::string text = R"({"warnings":[)";
    for (size_t i = 0; i < count; ++i) text += R"("",)";
    for (const std::string& frame : frames) {
      std::filesystem::create_directories(out / frame);
      std::ofstream(out / frame / "job.json") << text << R"(""]})";
    }
  };
  write(80'000);  // 240 KB each, and more values than one of ours
  const grpc::Status refused = WriteAs("anna", "flood", frames);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("more than 2 MiB of job.json"));
  write(1'300'000);  // 4 MB each: nobody's
  EXPECT_TRUE(WriteAs("anna", "flood", frames).ok());
}

// Results that are slow to read keep the jobs of their owner, not those of others.
TEST_F(DaemonOwnersTest, SlowResultsOfOneKeepNoOthersEnd) {
  std::promise<void> over;
  options_.endings.write_report = [end = over.get_future().share()](const std::string& folder,
                                                                    const v1::Job&) {
    if (folder.find("slow") != std::string::npos) end.wait();
    return absl::OkStatus();
  };
  StartDaemon();
  std::vector<v1::Job> slow(3);
  for (size_t i = 0; i < slow.size(); ++i)
    ASSERT_TRUE(SubmitAs("anna", MakeRequest({"a"}, "slow" + std::to_string(i)), &slow[i]).ok());
  v1::Job other;
  ASSERT_TRUE(SubmitAs("ben", MakeRequest({"a"}, "other"), &other).ok());
  EXPECT_EQ(WaitForEnd(other.id()).state(), v1::JOB_STATE_DONE);
  for (const v1::Job& job : slow) EXPECT_NE(client_->Get(job.id())->state(), v1::JOB_STATE_DONE);
  over.set_value();
  for (const v1::Job& job : slow) EXPECT_EQ(WaitForEnd(job.id()).state(), v1::JOB_STATE_DONE);
}

}  // namespace
}  // namespace weft
