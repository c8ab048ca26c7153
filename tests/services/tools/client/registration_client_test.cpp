#include "services/tools/client/registration_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/server/rpc/message_limit.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

grpc::Status JobNotFound() { return {grpc::StatusCode::NOT_FOUND, "there is no job j9"}; }

class RegistrationClientTest : public ::testing::Test {
 protected:
  // Answers with a job of the request's id.
  template <typename Request>
  auto Echo() {
    return [](const Request& request, v1::Job* job) {
      job->set_id(request.job_id());
      return grpc::Status::OK;
    };
  }
  RegistrationClient& client() { return daemon_.client(); }

  AnsweringDaemon daemon_;
  const TempFolder folder_;
};

TEST_F(RegistrationClientTest, KnowsTheDaemonItIsConnectedTo) {
  EXPECT_EQ(client().server(), daemon_.address());
  EXPECT_EQ(client().info().version(), "7.8.9");
}

TEST_F(RegistrationClientTest, CallsNameTheJob) {
  daemon_.jobs.get = Echo<v1::GetJobRequest>();
  daemon_.jobs.cancel = Echo<v1::CancelJobRequest>();
  daemon_.jobs.retry = Echo<v1::RetryJobRequest>();
  EXPECT_EQ(client().Get("j1")->id(), "j1");
  EXPECT_EQ(client().Cancel("j2")->id(), "j2");
  EXPECT_EQ(client().Retry("j3")->id(), "j3");
  daemon_.jobs.get = [](const v1::GetJobRequest&, v1::Job*) { return JobNotFound(); };
  EXPECT_EQ(client().Get("j9").status(), absl::NotFoundError("there is no job j9"));
}

// gRPC's own limit is 4 MiB for answers, and none for requests.
TEST_F(RegistrationClientTest, AnswersMayBeLargeAndRequestsMayNot) {
  daemon_.jobs.get = [](const v1::GetJobRequest&, v1::Job* job) {
    job->set_id(std::string(size_t{5} << 20, 'x'));
    return grpc::Status::OK;
  };
  EXPECT_EQ(client().Get("j1")->id().size(), size_t{5} << 20);
  daemon_.jobs.get = Echo<v1::GetJobRequest>();
  EXPECT_TRUE(absl::IsResourceExhausted(client().Get(std::string(kLargestRequest_bytes + 1, 'x')).status()));
}

TEST_F(RegistrationClientTest, ASubmissionIsRepeatedOnlyWhereItHasAKey) {
  int calls = 0;
  daemon_.jobs.submit = [&](const v1::SubmitJobRequest& request, v1::Job* job) {
    if (++calls == 1) return BrokenOff();
    job->set_id(request.idempotency_key());
    return grpc::Status::OK;
  };
  v1::SubmitJobRequest request;
  const absl::Status once = client().Submit(request).status();
  EXPECT_EQ(once, absl::UnavailableError("the daemon is shutting down"));
  EXPECT_EQ(calls, 1);
  calls = 0;
  request.set_idempotency_key("k");
  const auto again = client().Submit(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->id(), "k");
  EXPECT_EQ(calls, 2);
}

TEST_F(RegistrationClientTest, ListsReadPagesUpToTheLimit) {
  std::vector<std::pair<int, std::string>> asked;
  daemon_.jobs.list = [&](const v1::ListJobsRequest& request, v1::ListJobsResponse* out) {
    asked.emplace_back(request.limit(), request.page_token());
    for (int i = 0; i < std::min(60, request.limit()); ++i) out->add_jobs()->set_id(std::to_string(i));
    out->set_next_page_token("more");
    return grpc::Status::OK;
  };
  EXPECT_THAT(*client().List(0), SizeIs(100));
  EXPECT_THAT(asked, ElementsAre(std::pair(100, std::string()), std::pair(40, std::string("more"))));
  asked.clear();
  EXPECT_THAT(*client().List(7), SizeIs(7));
  EXPECT_THAT(asked, ElementsAre(std::pair(7, std::string())));
}

TEST_F(RegistrationClientTest, FramesAreThoseOfAllPages) {
  daemon_.jobs.frames = [&](const v1::ListFramesRequest& request, v1::ListFramesResponse* out) {
    EXPECT_EQ(request.job_id(), "j1");
    EXPECT_EQ(request.limit(), 0);
    out->add_frames()->set_frame(request.page_token() + "1");
    if (request.page_token().empty()) out->set_next_page_token("b");
    return grpc::Status::OK;
  };
  const auto frames = client().Frames("j1");
  ASSERT_TRUE(frames.ok()) << frames.status();
  ASSERT_THAT(*frames, SizeIs(2));
  EXPECT_EQ((*frames)[0].frame(), "1");
  EXPECT_EQ((*frames)[1].frame(), "b1");
}

v1::JobUpdate UpdateOf(const std::string& id, v1::JobState state) {
  v1::JobUpdate update;
  update.mutable_job()->set_id(id);
  update.mutable_job()->set_state(state);
  return update;
}

TEST_F(RegistrationClientTest, AWatchAnswersTheLastState) {
  daemon_.jobs.watch = [](const v1::WatchJobRequest& request, grpc::ServerWriter<v1::JobUpdate>* out) {
    out->Write(UpdateOf(request.job_id(), v1::JOB_STATE_RUNNING));
    out->Write(UpdateOf(request.job_id(), v1::JOB_STATE_DONE));
    return grpc::Status::OK;
  };
  std::vector<v1::JobState> states;
  const auto last =
      client().Watch("j1", [&](const v1::JobUpdate& update) { states.push_back(update.job().state()); });
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_EQ(last->state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(last->id(), "j1");
  EXPECT_THAT(states, ElementsAre(v1::JOB_STATE_RUNNING, v1::JOB_STATE_DONE));
  EXPECT_EQ(client().Watch("j1", nullptr)->state(), v1::JOB_STATE_DONE);
}

TEST_F(RegistrationClientTest, AWatchSaysWhyItEndsEarly) {
  const auto why = [&](const grpc::Status& end, bool has_update) {
    daemon_.jobs.watch = [&](const v1::WatchJobRequest&, grpc::ServerWriter<v1::JobUpdate>* out) {
      if (has_update) out->Write(UpdateOf("j1", v1::JOB_STATE_RUNNING));
      return end;
    };
    return client().Watch("j1", nullptr).status();
  };
  const absl::Status away = why(BrokenOff(), true);
  EXPECT_TRUE(absl::IsUnavailable(away));
  EXPECT_EQ(away.message(),
            "the daemon at " + daemon_.address() +
                " went away (the daemon is shutting down); job j1 continues when it is started "
                "again: `weft job watch j1`");
  EXPECT_EQ(why(BrokenOff(), false).message(), "the daemon is shutting down");
  EXPECT_EQ(why(JobNotFound(), true), absl::NotFoundError("there is no job j9"));
}

TEST_F(RegistrationClientTest, AWatchThatIsStoppedLeavesTheJobAlone) {
  std::stop_source stop;
  daemon_.jobs.watch = [](const v1::WatchJobRequest&, grpc::ServerWriter<v1::JobUpdate>* out) {
    while (out->Write(UpdateOf("j1", v1::JOB_STATE_RUNNING))) {
    }
    return grpc::Status::OK;
  };
  const absl::Status stopped =
      client()
          .Watch(
              "j1", [&](const v1::JobUpdate&) { stop.request_stop(); }, stop.get_token())
          .status();
  EXPECT_EQ(stopped, absl::CancelledError("stopped watching; job j1 continues at " + daemon_.address()));
}

class FetchTest : public RegistrationClientTest {
 protected:
  using Writer = grpc::ServerWriter<v1::FileChunk>;
  absl::Status Fetch() { return client().Fetch("j1", "0007", v1::RESULT_KIND_MESH, folder_ / "mesh.ply"); }
  std::vector<v1::FetchResultRequest> asked_;
};

TEST_F(FetchTest, WritesTheFileThatIsNamed) {
  daemon_.jobs.fetch = [&](const v1::FetchResultRequest& request, Writer* out) {
    asked_.push_back(request);
    out->Write(Chunk("abc", 0, 5, "v1"));
    out->Write(Chunk("de", 3, 5, "v1"));
    return grpc::Status::OK;
  };
  ASSERT_TRUE(Fetch().ok());
  EXPECT_EQ(ReadBytes(folder_ / "mesh.ply"), "abcde");
  ASSERT_THAT(asked_, SizeIs(1));
  EXPECT_EQ(asked_[0].job_id(), "j1");
  EXPECT_EQ(asked_[0].frame(), "0007");
  EXPECT_EQ(asked_[0].kind(), v1::RESULT_KIND_MESH);
  EXPECT_EQ(asked_[0].offset(), 0);
  EXPECT_EQ(asked_[0].version(), "");
}

TEST_F(FetchTest, GoesOnWhereItBrokeOff) {
  daemon_.jobs.fetch = [&](const v1::FetchResultRequest& request, Writer* out) {
    asked_.push_back(request);
    if (asked_.size() == 1) {
      out->Write(Chunk("abc", 0, 5, "v1"));
      return BrokenOff();
    }
    out->Write(Chunk("de", 3, 5, "v1"));
    return grpc::Status::OK;
  };
  ASSERT_TRUE(Fetch().ok());
  EXPECT_EQ(ReadBytes(folder_ / "mesh.ply"), "abcde");
  ASSERT_THAT(asked_, SizeIs(2));
  EXPECT_EQ(asked_[1].offset(), 3);
  EXPECT_EQ(asked_[1].version(), "v1");
}

TEST_F(FetchTest, BeginsAgainWhereTheFileWasWrittenAnew) {
  daemon_.jobs.fetch = [&](const v1::FetchResultRequest& request, Writer* out) {
    asked_.push_back(request);
    if (asked_.size() == 1) {
      out->Write(Chunk("old", 0, 5, "v1"));
      return grpc::Status(grpc::StatusCode::ABORTED, "it was written anew");
    }
    out->Write(Chunk("new", 0, 3, "v2"));
    return grpc::Status::OK;
  };
  ASSERT_TRUE(Fetch().ok());
  EXPECT_EQ(ReadBytes(folder_ / "mesh.ply"), "new");
  ASSERT_THAT(asked_, SizeIs(2));
  EXPECT_EQ(asked_[1].offset(), 0);
  EXPECT_EQ(asked_[1].version(), "");
}

// Daemons of earlier versions know nothing of offsets.
TEST_F(FetchTest, TakesTheWholeFileFromADaemonWithoutVersions) {
  daemon_.jobs.fetch = [&](const v1::FetchResultRequest& request, Writer* out) {
    asked_.push_back(request);
    out->Write(Chunk("abc", 0, 5, ""));
    if (asked_.size() == 1) return BrokenOff();
    out->Write(Chunk("de", 3, 5, ""));
    return grpc::Status::OK;
  };
  ASSERT_TRUE(Fetch().ok());
  EXPECT_EQ(ReadBytes(folder_ / "mesh.ply"), "abcde");
}

TEST_F(FetchTest, LeavesNoFileThatIsNotWhole) {
  daemon_.jobs.fetch = [](const v1::FetchResultRequest&, Writer* out) {
    out->Write(Chunk("abc", 0, 5, "v1"));
    return grpc::Status::OK;
  };
  EXPECT_EQ(Fetch(), absl::DataLossError(folder_ / "mesh.ply" +
                                         std::string(": 3 of 5 bytes arrived; fetch it again")));
  daemon_.jobs.fetch = [](const v1::FetchResultRequest&, Writer*) { return JobNotFound(); };
  EXPECT_TRUE(absl::IsNotFound(Fetch()));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST(RegistrationClient, SaysHowToStartADaemonWhereNoneAnswers) {
  const absl::Status silent = RegistrationClient::Connect("127.0.0.1:1").status();
  EXPECT_TRUE(absl::IsUnavailable(silent)) << silent;
  EXPECT_THAT(std::string(silent.message()), AllOf(HasSubstr("no daemon answers at 127.0.0.1:1: "),
                                                   HasSubstr("`weftd --listen 127.0.0.1:1 --state DIR")));
}

TEST(RegistrationClient, TellsWhatIsNoDaemon) {
  AnsweringJobs jobs;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&jobs);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const std::string address = absl::StrCat("127.0.0.1:", port);
  EXPECT_EQ(
      RegistrationClient::Connect(address).status(),
      absl::FailedPreconditionError("what answers at " + address + " is not weftd; check host and port"));
}

}  // namespace
}  // namespace weft
