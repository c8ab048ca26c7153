// What a daemon's retention looks after: takes, their trash, jobs, operations, uploads and notices.
#include <sys/stat.h>

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/tools/client/operation_client.h"
#include "services/tools/client/server_client.h"
#include "services/work/items/sha256.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "tests/services/server/daemon/wait_until.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class DaemonRetentionTest : public DaemonTest {
 protected:
  DaemonRetentionTest() {
    WriteBytes(folder_ / "program", "#!/bin/sh\nexit 0\n");
    fs::permissions(folder_ / "program", fs::perms::owner_all);
    options_.command_program = folder_ / "program";
    for (const char* id : {"20260101-000000-00000000", "20260101-000000-00000001"}) {
      const std::string folder = folder_ / (std::string("state/takes/") + id);
      const RecorderFiles files(folder);
      fs::create_directories(folder);
      v1::RecorderState state;
      state.set_phase(v1::RECORDER_PHASE_ENDED);
      state.set_updated_unix_ns(1);
      EXPECT_TRUE(WriteJsonFile(files.request, v1::RecorderRequest()).ok());
      EXPECT_TRUE(WriteJsonFile(files.state, state).ok());
    }
    options_.notices.server.url = "http://127.0.0.1:1/hook";  // nobody hears, so notices wait
  }
  grpc::Status BeginUpload(v1::BeginUploadResponse* response) {
    v1::BeginUploadRequest request;
    request.set_kind(v1::ITEM_KIND_RIG);
    request.set_name("lab");
    v1::ItemFile& file = *request.mutable_manifest()->add_files();
    file.set_path("rig.json");
    file.set_bytes(2);
    file.set_sha256(Sha256().Add("{}").Hex());
    grpc::ClientContext context;
    const auto stub = v1::Library::NewStub(client_->channel());
    const auto writer = stub->BeginUpload(&context, response);
    writer->Write(request);
    writer->WritesDone();
    return writer->Finish();
  }
  // "KIND ID" of what would go within a day by these rules.
  std::vector<std::string> WouldGo(const v1::RetentionRules& rules) {
    v1::RehearseRetentionRequest request;
    *request.mutable_rules() = rules;
    request.set_ahead_days(1);
    const auto rehearsal = ServerClient(*client_).RehearseRetention(request);
    EXPECT_TRUE(rehearsal.ok()) << rehearsal.status();
    std::vector<std::string> steps;
    if (!rehearsal.ok()) return steps;
    for (const v1::RetentionStep& step : rehearsal->steps())
      steps.push_back(v1::HoldingKind_Name(step.kind()).substr(13) + " " + step.id());
    std::sort(steps.begin(), steps.end());
    return steps;
  }
};

TEST_F(DaemonRetentionTest, KnowsAllThatMayGoAndLetsItGo) {
  StartDaemon();
  const std::string job = Submit({"a"});
  WaitForEnd(job);
  v1::StartOperationRequest operation;
  operation.set_idempotency_key("an-operation");
  operation.mutable_spec()->set_command("take verify");
  v1::OperationInput& input = *operation.mutable_spec()->add_inputs();
  input.set_name("take");
  input.set_value(folder_ / "shirt");
  OperationClient operations(*client_);
  ASSERT_TRUE(operations.Start(operation).ok());
  ASSERT_TRUE(operations.Watch("an-operation", [](const v1::Operation&) {}).ok());
  v1::BeginUploadResponse upload;
  ASSERT_TRUE(BeginUpload(&upload).ok());
  EXPECT_THAT(WouldGo({}), IsEmpty());
  v1::RetentionRules rules;
  for (const auto& set :
       {&v1::RetentionRules::set_keep_takes_days, &v1::RetentionRules::set_keep_jobs_days,
        &v1::RetentionRules::set_keep_trash_days, &v1::RetentionRules::set_keep_uploads_days,
        &v1::RetentionRules::set_keep_notices_days})
    (rules.*set)(1e-7);
  std::vector<std::string> would_go = WouldGo(rules);
  std::string notice;
  std::erase_if(would_go, [&](const std::string& step) {
    if (step.rfind("NOTICE ", 0) == 0) notice = step;
    return step.rfind("NOTICE ", 0) == 0;
  });
  EXPECT_THAT(notice, HasSubstr("NOTICE url/"));
  EXPECT_THAT(notice, HasSubstr(job));
  EXPECT_THAT(would_go, ElementsAre("JOB " + job, "OPERATION an-operation", "TAKE 20260101-000000-00000000",
                                    "TAKE 20260101-000000-00000001", "TRASH 20260101-000000-00000000",
                                    "TRASH 20260101-000000-00000001", "UPLOAD " + upload.upload_id()));
  // All of them, by the rules that come into force.
  daemon_->SetRetention(rules);
  EXPECT_TRUE(WaitUntil([this, &rules] { return WouldGo(rules).empty(); }));
  EXPECT_EQ(client_->List(10)->size(), 0u);
  EXPECT_EQ(operations.List(10)->operations_size(), 0);
  for (const char* folder : {"takes", "trash", "operations", "uploads"})
    EXPECT_TRUE(fs::is_empty(folder_ / (std::string("state/") + folder))) << folder;
  EXPECT_TRUE(fs::exists(folder_ / "state/retention.json"));
}

TEST_F(DaemonRetentionTest, UploadsLeaveTheRoomThatTakesWant) {
  options_.retention.set_least_free_gib(1e6);
  StartDaemon();
  v1::BeginUploadResponse response;
  EXPECT_EQ(BeginUpload(&response).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  v1::RetentionRules rules;
  daemon_->SetRetention(rules);
  EXPECT_TRUE(BeginUpload(&response).ok());
  rules.set_least_free_gib(1e6);
  daemon_->SetRetention(rules);
  EXPECT_EQ(BeginUpload(&response).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  v1::RehearseRetentionRequest request;
  request.set_ahead_days(-1);
  EXPECT_EQ(ServerClient(*client_).RehearseRetention(request).status().message(),
            "ahead_days: -1 is out of range; give 0 to 36500");
}

}  // namespace
}  // namespace weft
