// What the daemon answers to requests, good and hostile.
#include <grpcpp/grpcpp.h>

#include <optional>

#include "base/host_clock.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/message_limit.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "tests/services/server/daemon/raw_call.h"

namespace weft {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(DaemonTest, AnswersTheStandardHealthCheck) {
  StartDaemon();
  for (const std::string service :
       {"weft.v1.Cameras", "weft.v1.Jobs", "weft.v1.Library", "weft.v1.Operations", "weft.v1.Server",
        "weft.v1.Sessions", "weft.v1.Takes"})
    EXPECT_EQ(AskHealth(daemon_->address(), service), "SERVING") << service;
}

TEST_F(DaemonTest, ListsItsServicesByReflection) {
  StartDaemon();
  // ServerReflectionRequest{list_services: ""}.
  const std::string answer =
      RawCall(daemon_->address(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
              std::string("\x3a\x00", 2));
  EXPECT_THAT(answer, HasSubstr("weft.v1.Jobs"));
  EXPECT_THAT(answer, HasSubstr("weft.v1.Server"));
  EXPECT_THAT(answer, HasSubstr("grpc.health.v1.Health"));
}

TEST_F(DaemonTest, TellsWhoItIs) {
  StartDaemon();
  EXPECT_EQ(client_->info().workers(), 1);
  EXPECT_EQ(client_->info().threads_per_worker(), 1);
  EXPECT_EQ(client_->info().state_folder(), std::filesystem::canonical(folder_ / "state").string());
  ASSERT_EQ(client_->info().allowed_paths_size(), 1);
  EXPECT_FALSE(client_->info().version().empty());
}

TEST_F(DaemonTest, NamesTheFieldOfEveryMalformedRequest) {
  StartDaemon();
  const struct {
    const char* field;
    std::function<void(v1::SubmitJobRequest&)> spoil;
  } cases[] = {
      {"spec:", [](auto& r) { r.clear_spec(); }},
      {"spec.dump:", [](auto& r) { r.mutable_spec()->clear_dump(); }},
      {"spec.rig:", [](auto& r) { r.mutable_spec()->set_rig("/" + std::string(10'000, 'x')); }},
      {"spec.board:", [](auto& r) { r.mutable_spec()->set_board(std::string("/a\0b", 4)); }},
      {"spec.garment:", [](auto& r) { r.mutable_spec()->set_garment("relative/shirt"); }},
      {"spec.out:", [](auto& r) { r.mutable_spec()->set_out("a\nb"); }},
      {"spec.first_frame:", [](auto& r) { r.mutable_spec()->set_first_frame(-1); }},
      {"spec.end_frame:", [](auto& r) { r.mutable_spec()->set_end_frame(-5); }},
      {"spec.end_frame:",
       [](auto& r) {
         r.mutable_spec()->set_first_frame(5);
         r.mutable_spec()->set_end_frame(5);
       }},
      {"spec.options.preset:", [](auto& r) { r.mutable_spec()->mutable_options()->set_preset("fastest"); }},
      {"spec.expected.rig:", [](auto& r) { r.mutable_spec()->mutable_expected()->set_rig("12"); }},
      {"spec.driving.avatar:", [](auto& r) { r.mutable_spec()->mutable_driving(); }},
      {"spec.driving.cameras:",
       [](auto& r) {
         r.mutable_spec()->mutable_driving()->set_avatar("/shirt.avatar");
         r.mutable_spec()->mutable_driving()->add_cameras("a\nb");
       }},
      {"spec.driving.fps:",
       [](auto& r) {
         r.mutable_spec()->mutable_driving()->set_avatar("/shirt.avatar");
         r.mutable_spec()->mutable_driving()->set_fps(-1);
       }},
      {"spec.live_every:",
       [](auto& r) {
         r.mutable_spec()->mutable_driving()->set_avatar("/shirt.avatar");
         r.mutable_spec()->set_live_every(2);
       }},
      {"spec.options:",
       [](auto& r) {
         r.mutable_spec()->mutable_driving()->set_avatar("/shirt.avatar");
         r.mutable_spec()->mutable_options()->set_scans("/scans");
       }},
      {"out_probe:", [](auto& r) { r.set_out_probe("../probe"); }},
      {"idempotency_key:", [](auto& r) { r.set_idempotency_key("../../key"); }},
      {"idempotency_key:", [](auto& r) { r.set_idempotency_key("short"); }},
      {"idempotency_key:", [](auto& r) { r.set_idempotency_key(std::string(65, 'a')); }},
      {"priority:", [](auto& r) { r.set_priority(101); }},
  };
  for (const auto& c : cases) {
    v1::SubmitJobRequest request = MakeRequest({"a"});
    c.spoil(request);
    const absl::Status status = client_->Submit(request).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << c.field << " " << status;
    EXPECT_THAT(std::string(status.message()), StartsWith(c.field));
    const std::optional<v1::ErrorDetail> detail = DetailOf(status);
    ASSERT_TRUE(detail) << c.field;
    EXPECT_EQ(detail->field() + ":", c.field);
    EXPECT_THAT(std::string(status.message()), EndsWith(detail->remedy()));
  }
}

TEST_F(DaemonTest, TellsItsTime) {
  const int64_t before = HostTime_ns();
  StartDaemon();
  EXPECT_LE(before, client_->info().started_unix_ns());
  EXPECT_LE(client_->info().started_unix_ns(), client_->info().unix_ns());
  EXPECT_LE(client_->info().unix_ns(), HostTime_ns());
}

TEST_F(DaemonTest, RefusesPathsOutsideItsFolders) {
  StartDaemon();
  for (const char* outside : {"/etc/passwd", "/etc/../etc/passwd", "/no/such/file"}) {
    v1::SubmitJobRequest request = MakeRequest({"a"});
    request.mutable_spec()->set_rig(outside);
    const absl::Status status = client_->Submit(request).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << status;
    EXPECT_THAT(std::string(status.message()), StartsWith("spec.rig:"));
    ASSERT_TRUE(DetailOf(status));
    EXPECT_THAT(DetailOf(status)->remedy(), HasSubstr("--allow-path"));
  }
  v1::SubmitJobRequest request = MakeRequest({"a"});
  request.mutable_spec()->set_out("/tmp/../elsewhere");
  EXPECT_EQ(client_->Submit(request).status().code(), absl::StatusCode::kPermissionDenied);
}

TEST_F(DaemonTest, KeepsTheCategoryOfInputErrors) {
  options_.load_inputs = [](const v1::RegistrationSpec&) -> absl::StatusOr<LoadedInputs> {
    return absl::FailedPreconditionError("template of board 0a, board is 0b");
  };
  StartDaemon();
  const absl::Status status = client_->Submit(MakeRequest({"a"})).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(), "template of board 0a, board is 0b");
}

TEST_F(DaemonTest, SurvivesALoaderThatThrowsAndMessagesWithoutEnd) {
  options_.load_inputs = [](const v1::RegistrationSpec& spec) -> absl::StatusOr<LoadedInputs> {
    if (spec.first_frame() == 1) throw std::runtime_error("broken library");
    return absl::InvalidArgumentError(std::string(1 << 20, 'x'));
  };
  StartDaemon();
  v1::SubmitJobRequest request = MakeRequest({"a"});
  EXPECT_EQ(client_->Submit(request).status().code(), absl::StatusCode::kInvalidArgument);
  request.mutable_spec()->set_first_frame(1);
  const absl::Status status = client_->Submit(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("broken library"));
}

TEST_F(DaemonTest, RefusesMessagesBeyondItsLimit) {
  StartDaemon();
  v1::SubmitJobRequest request = MakeRequest({"a"});
  // Of one who knows no limit: a little above it.
  request.set_out_probe(std::string(kLargestRequest_bytes + (64 << 10), 'x'));
  const auto careless =
      v1::Jobs::NewStub(grpc::CreateChannel(daemon_->address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  v1::Job job;
  const grpc::Status refused = careless->SubmitJob(&context, request, &job);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << refused.error_message();
  // Our client does not send what would end its connection.
  request.set_out_probe(std::string(2 * kLargestRequest_bytes, 'x'));
  EXPECT_EQ(client_->Submit(request).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(client_->List(0).ok());
}

TEST_F(DaemonTest, SaysNotFoundOfUnknownJobs) {
  StartDaemon();
  for (const absl::Status& status : {client_->Get("x").status(), client_->Frames("x").status(),
                                     client_->Cancel("x").status(), client_->Watch("x", {}).status(),
                                     client_->Fetch("x", "a", v1::RESULT_KIND_MESH, folder_ / "mesh.ply")}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("\"x\""));
  }
  EXPECT_EQ(client_->Get("").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(client_->List(-1).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "mesh.ply"));
}

TEST(CheckFetchRequest, WantsAFrameForFilesOfFramesAlone) {
  v1::FetchResultRequest request;
  request.set_job_id("j");
  EXPECT_THAT(std::string(CheckFetchRequest(request).message()), StartsWith("kind:"));
  request.set_kind(v1::RESULT_KIND_MESH);
  EXPECT_THAT(std::string(CheckFetchRequest(request).message()), StartsWith("frame:"));
  request.set_frame("../0001");
  EXPECT_THAT(std::string(CheckFetchRequest(request).message()), StartsWith("frame:"));
  request.set_frame("0001");
  EXPECT_TRUE(CheckFetchRequest(request).ok());
  request.set_kind(v1::RESULT_KIND_JOB);
  EXPECT_THAT(std::string(CheckFetchRequest(request).message()), StartsWith("frame:"));
}

}  // namespace
}  // namespace weft
