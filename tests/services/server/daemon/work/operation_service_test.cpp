// Operations of a daemon, through its calls.
#include <grpcpp/grpcpp.h>

#include <filesystem>

#include "services/server/daemon/studio/take_folder.h"
#include "services/server/rpc/error_detail.h"
#include "services/tools/client/library_client.h"
#include "services/tools/client/operation_client.h"
#include "services/tools/client/take_client.h"
#include "services/work/items/item_files.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "tests/services/server/daemon/wait_until.h"
#include "tests/services/studio/recording/recorded_pattern.h"
#include "weft/v1/operations.grpc.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class OperationServiceTest : public DaemonTest {
 protected:
  OperationServiceTest() {
    WriteBytes(folder_ / "program",
               "#!/bin/sh\necho \"$*\" > '" + folder_ / "arguments" + "'\n. '" + folder_ / "script" + "'\n");
    fs::permissions(folder_ / "program", fs::perms::owner_all);
    options_.command_program = folder_ / "program";
    options_.worker_memory_mib = -1;
    WriteBytes(folder_ / "script", "exit 0\n");
    WriteBytes(folder_ / "data/take", "");
  }
  v1::Operations::Stub Stub() { return v1::Operations::Stub(client_->channel()); }
  static v1::StartOperationRequest Request(const std::string& command, const std::string& take,
                                           const std::string& key = "0123-weft") {
    v1::StartOperationRequest request;
    request.set_idempotency_key(key);
    request.mutable_spec()->set_command(command);
    v1::OperationInput& input = *request.mutable_spec()->add_inputs();
    input.set_name("take");
    input.set_value(take);
    return request;
  }
  // The last word that the program was given.
  std::string InputGiven() {
    const std::string said = ReadBytes(folder_ / "arguments");
    return said.substr(said.rfind(" -- ") + 4, said.size() - said.rfind(" -- ") - 5);
  }
  v1::Operation Run(const v1::StartOperationRequest& request) {
    OperationClient operations(*client_);
    const auto started = operations.Start(request);
    EXPECT_TRUE(started.ok()) << started.status();
    const auto ended = operations.Watch(request.idempotency_key(), [](const v1::Operation&) {});
    EXPECT_TRUE(ended.ok()) << ended.status();
    return ended.ok() ? *ended : v1::Operation();
  }
  std::string Real(const std::string& path) { return fs::canonical(folder_ / path).string(); }
};

TEST_F(OperationServiceTest, AreStartedWatchedListedAndDeleted) {
  StartDaemon();
  WriteBytes(folder_ / "script", "mkdir deep; echo one > deep/a; printf '' > b; echo said\n");
  const v1::Operation ended = Run(Request("take verify", folder_ / "data/take"));
  EXPECT_EQ(ended.state(), v1::JOB_STATE_DONE) << ended.message();
  EXPECT_EQ(ended.output(), "said\n");
  EXPECT_THAT(ended.started_by(), HasSubstr("user "));
  EXPECT_EQ(InputGiven(), Real("data/take"));
  EXPECT_THAT(ReadBytes(folder_ / "arguments"), HasSubstr(" --memory-mib=0 --may-read="));
  OperationClient operations(*client_);
  EXPECT_EQ(operations.List(1)->operations(0).id(), "0123-weft");
  size_t done = 0;
  ASSERT_TRUE(
      operations.FetchFiles("0123-weft", folder_ / "fetched", [&](size_t now, size_t) { done = now; }).ok());
  EXPECT_EQ(done, 2u);
  EXPECT_EQ(ReadBytes(folder_ / "fetched/deep/a"), "one\n");
  EXPECT_TRUE(fs::exists(folder_ / "fetched/b"));
  EXPECT_EQ(operations.Delete("0123-weft")->id(), "0123-weft");
  EXPECT_EQ(operations.List(1)->operations_size(), 0);
  EXPECT_EQ(operations.Watch("0123-weft", [](const v1::Operation&) {}).status().code(),
            absl::StatusCode::kNotFound);
}

TEST_F(OperationServiceTest, CallsThatAreWrongAreRefusedByTheField) {
  StartDaemon();
  Run(Request("take verify", folder_ / "data/take"));
  v1::Operations::Stub stub = Stub();
  const auto message = [](const grpc::Status& status) { return status.error_message(); };
  {
    grpc::ClientContext context;
    v1::ListOperationsRequest request;
    request.set_limit(-1);
    v1::ListOperationsResponse response;
    EXPECT_EQ(message(stub.ListOperations(&context, request, &response)),
              "limit: -1 is negative; give 0 for the default");
  }
  {
    grpc::ClientContext context;
    v1::ListOperationFilesRequest request;
    request.set_limit(-1);
    v1::ListOperationFilesResponse response;
    EXPECT_EQ(message(stub.ListOperationFiles(&context, request, &response)),
              "limit: -1 is negative; give 0 for all");
  }
  {
    grpc::ClientContext context;
    v1::FetchOperationFileRequest request;
    request.set_operation_id("0123-weft");
    request.set_path("b");
    request.set_offset(-1);
    v1::FileChunk chunk;
    const auto reader = stub.FetchOperationFile(&context, request);
    EXPECT_FALSE(reader->Read(&chunk));
    EXPECT_EQ(message(reader->Finish()), "offset: -1 is negative; count bytes from 0");
  }
  {
    grpc::ClientContext context;
    v1::GetOperationRequest request;
    request.set_operation_id("0123-weft");
    v1::Operation operation;
    ASSERT_TRUE(stub.GetOperation(&context, request, &operation).ok());
    EXPECT_EQ(operation.spec().inputs_size(), 1);
  }
}

TEST_F(OperationServiceTest, FilesAreFetchedFromAnyByte) {
  StartDaemon();
  WriteBytes(folder_ / "script", "printf 0123456789 > file\n");
  Run(Request("take verify", folder_ / "data/take"));
  v1::Operations::Stub stub = Stub();
  v1::FetchOperationFileRequest request;
  request.set_operation_id("0123-weft");
  request.set_path("file");
  v1::FileChunk chunk;
  {
    grpc::ClientContext context;
    const auto reader = stub.FetchOperationFile(&context, request);
    ASSERT_TRUE(reader->Read(&chunk));
    EXPECT_EQ(chunk.data(), "0123456789");
    EXPECT_FALSE(reader->Read(&chunk));
    EXPECT_TRUE(reader->Finish().ok());
  }
  request.set_offset(6);
  request.set_version(chunk.version());
  grpc::ClientContext context;
  const auto reader = stub.FetchOperationFile(&context, request);
  ASSERT_TRUE(reader->Read(&chunk));
  EXPECT_EQ(chunk.data(), "6789");
}

TEST_F(OperationServiceTest, AreCancelled) {
  WriteBytes(folder_ / "script", "exec sleep 60\n");
  StartDaemon();
  OperationClient operations(*client_);
  ASSERT_TRUE(operations.Start(Request("take verify", folder_ / "data/take")).ok());
  ASSERT_TRUE(operations.Cancel("0123-weft").ok());
  EXPECT_EQ(operations.Watch("0123-weft", [](const v1::Operation&) {})->state(), v1::JOB_STATE_CANCELLED);
}

// Paths, takes of the daemon, results of jobs, and items of the library.
TEST_F(OperationServiceTest, ReadWhatTheirInputsName) {
  options_.check_item = [](v1::ItemKind, const v1::ItemManifest&, const std::string&) {
    return absl::OkStatus();
  };
  fs::create_directories(folder_ / "state/takes/20260101-000000-00000000/take");
  StartDaemon();
  const std::string job = Submit({"a"});
  WaitForEnd(job);
  WriteBytes(folder_ / "local/0000/a.png", "x");
  const auto files = ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "local");
  ASSERT_TRUE(files.ok()) << files.status();
  const auto item = LibraryClient(*client_).Upload(v1::ITEM_KIND_DUMP, "walk", *files);
  ASSERT_TRUE(item.ok()) << item.status();
  const std::pair<std::string, std::string> inputs[] = {
      {folder_ / "data/take", Real("data/take")},
      {"take:20260101-000000-00000000", Real("state/takes/20260101-000000-00000000/take")},
      {"job:" + job, Real("out")}};
  int runs = 0;
  for (const auto& [named, given] : inputs) {
    EXPECT_EQ(Run(Request("take verify", named, absl::StrCat("run-number-", ++runs))).state(),
              v1::JOB_STATE_DONE);
    EXPECT_EQ(InputGiven(), given);
  }
  EXPECT_EQ(Run(Request("take verify", "library:walk", "run-of-item")).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(ReadBytes(InputGiven() + "/0000/a.png"), "x");
  const std::pair<std::string, std::string> wrong[] = {
      {"/etc/passwd", "lies outside the folders that the daemon may use"},
      {"take:20260101-000000-00000001",
       "spec.inputs.take: take:20260101-000000-00000001: no such take; `weft take list` shows the takes"},
      {"job:unknown", "unknown"},
      {"library:run", "spec.inputs.take: the library has no dump \"run\""}};
  OperationClient operations(*client_);
  for (const auto& [named, words] : wrong) {
    const absl::Status status = operations.Start(Request("take verify", named, "another-key")).status();
    EXPECT_THAT(std::string(status.message()), HasSubstr(words)) << named;
  }
}

TEST_F(OperationServiceTest, AQueuedJobHasNothingToRead) {
  StartDaemon();
  Submit({"hang"}, "one");
  const std::string queued = Submit({"a"}, "two");
  const absl::Status status =
      OperationClient(*client_).Start(Request("take verify", "job:" + queued)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(),
            "spec.inputs.take: job:" + queued +
                ": is queued, so it has no results yet; wait for its end, `weft job watch " + queued + "`");
}

// What an operation reads stays, and what it makes becomes a take of the daemon.
TEST_F(OperationServiceTest, KeepTheirInputsAndMakeTakes) {
  PatternFrames frames({"left"}, 64, 48);
  RecordPattern(folder_ / "recorded", frames);
  WriteBytes(folder_ / "script", "while [ ! -e '" + folder_ / "go" + "' ]; do sleep 0.01; done; cp -r '" +
                                     folder_ / "recorded" + "' take\n");
  options_.check_item = [](v1::ItemKind, const v1::ItemManifest&, const std::string&) {
    return absl::OkStatus();
  };
  StartDaemon();
  WriteBytes(folder_ / "local/0000/a.png", "x");
  const auto files = ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "local");
  LibraryClient library(*client_);
  ASSERT_TRUE(library.Upload(v1::ITEM_KIND_DUMP, "walk", *files).ok());
  OperationClient operations(*client_);
  ASSERT_TRUE(operations.Start(Request("take trim", "library:walk", "trimmed-walk")).ok());
  ASSERT_TRUE(WaitUntil([this] { return fs::exists(folder_ / "arguments"); }));
  EXPECT_THAT(std::string(library.Delete(v1::ITEM_KIND_DUMP, "walk").status().message()),
              HasSubstr(": an operation uses it; wait for its end, or cancel it"));
  WriteBytes(folder_ / "go", "");
  const auto ended = operations.Watch("trimmed-walk", [](const v1::Operation&) {});
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->take_id(), "trimmed-walk") << ended->message();
  EXPECT_TRUE(library.Delete(v1::ITEM_KIND_DUMP, "walk").ok());
  TakeClient takes(*client_);
  const auto list = takes.List(0);
  ASSERT_EQ(list->takes_size(), 1);
  EXPECT_EQ(list->takes(0).state().message(), "made by operation trimmed-walk");
  // Its id is taken now, in the trash, too.
  ASSERT_TRUE(operations.Delete("trimmed-walk").ok());
  for (const bool in_trash : {false, true}) {
    if (in_trash) {
      ASSERT_TRUE(takes.Delete("trimmed-walk").ok());
    }
    EXPECT_EQ(operations.Start(Request("take trim", folder_ / "recorded", "trimmed-walk")).status().code(),
              absl::StatusCode::kAlreadyExists)
        << in_trash;
  }
}

// `weft evaluate` reads paths that files name: all that clients may name, and what is the daemon's for
// clients.
TEST_F(OperationServiceTest, SomeReadWhateverClientsMayName) {
  StartDaemon();
  v1::StartOperationRequest request = Request("evaluate", folder_ / "shirt");
  request.mutable_spec()->mutable_inputs(0)->set_name("result");
  request.mutable_spec()->set_out_name("evaluation");
  ASSERT_EQ(Run(request).state(), v1::JOB_STATE_DONE);
  const std::string said = ReadBytes(folder_ / "arguments");
  for (const char* path : {"shirt", "rig.json", "state/takes", "state/results", "state/library"})
    EXPECT_THAT(said, HasSubstr("--may-read=" + fs::canonical(folder_.path()).string() + "/" + path + " "))
        << path;
  EXPECT_THAT(said, ::testing::Not(HasSubstr("--may-read=" + fs::canonical(folder_.path()).string() + " ")));
  EXPECT_THAT(said, ::testing::Not(HasSubstr("state ")));
}

}  // namespace
}  // namespace weft
