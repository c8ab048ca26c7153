#include "services/tools/client/operation_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

class AnsweringOperations final : public v1::Operations::Service {
 public:
  std::vector<std::string> files;
  std::vector<std::string> asked;  // files, and ids of calls
  std::vector<int> limits;
  bool goes_on = false;  // a watch does not end

 private:
  using Context = grpc::ServerContext;
  grpc::Status Answer(const std::string& call, const std::string& id, v1::Operation* operation) {
    asked.push_back(call + " " + id);
    operation->set_id(id);
    return grpc::Status::OK;
  }
  grpc::Status StartOperation(Context*, const v1::StartOperationRequest* request,
                              v1::Operation* out) override {
    return Answer("start", request->idempotency_key(), out);
  }
  grpc::Status CancelOperation(Context*, const v1::CancelOperationRequest* request,
                               v1::Operation* out) override {
    return Answer("cancel", request->operation_id(), out);
  }
  grpc::Status DeleteOperation(Context*, const v1::DeleteOperationRequest* request,
                               v1::Operation* out) override {
    return Answer("delete", request->operation_id(), out);
  }
  grpc::Status ListOperations(Context*, const v1::ListOperationsRequest* request,
                              v1::ListOperationsResponse* out) override {
    limits.push_back(request->limit());
    for (int i = 0; i < 2; ++i) out->add_operations();
    if (limits.size() < 3) out->set_next_page_token("more");
    return grpc::Status::OK;
  }
  grpc::Status WatchOperation(Context*, const v1::WatchOperationRequest* request,
                              grpc::ServerWriter<v1::Operation>* out) override {
    if (request->operation_id() == "gone") return {grpc::StatusCode::NOT_FOUND, "no operation gone"};
    v1::Operation operation;
    operation.set_id(request->operation_id());
    operation.set_step("first");
    while (out->Write(operation) && goes_on) {
    }
    operation.set_step("last");
    out->Write(operation);
    return grpc::Status::OK;
  }
  grpc::Status ListOperationFiles(Context*, const v1::ListOperationFilesRequest* request,
                                  v1::ListOperationFilesResponse* out) override {
    EXPECT_EQ(request->operation_id(), "o1");
    for (const std::string& file : files) out->add_files()->set_path(file);
    return grpc::Status::OK;
  }
  grpc::Status FetchOperationFile(Context*, const v1::FetchOperationFileRequest* request,
                                  grpc::ServerWriter<v1::FileChunk>* out) override {
    asked.push_back(request->operation_id() + " " + request->path() + " " +
                    std::to_string(request->offset()) + " " + request->version());
    const std::string text = "of " + request->path();
    const auto bytes = static_cast<int64_t>(text.size());
    if (request->path() == "broken" && request->offset() == 0) {
      out->Write(Chunk(text.substr(0, 2), 0, bytes, "v1"));
      return BrokenOff();
    }
    out->Write(Chunk(text.substr(static_cast<size_t>(request->offset())), request->offset(), bytes, "v1"));
    return grpc::Status::OK;
  }
};

class OperationClientTest : public ::testing::Test {
 protected:
  absl::Status Fetch() {
    return client_.FetchFiles("o1", folder_ / "out",
                              [this](size_t done, size_t total) { progress_.emplace_back(done, total); });
  }

  AnsweringOperations operations_;
  AnsweringDaemon daemon_{{&operations_}};
  OperationClient client_{daemon_.client()};
  const TempFolder folder_;
  std::vector<std::pair<size_t, size_t>> progress_;
};

TEST_F(OperationClientTest, CallsNameTheOperation) {
  v1::StartOperationRequest request;
  request.set_idempotency_key("k");
  EXPECT_EQ(client_.Start(request)->id(), "k");
  EXPECT_EQ(client_.Cancel("o1")->id(), "o1");
  EXPECT_EQ(client_.Delete("o2")->id(), "o2");
  EXPECT_THAT(operations_.asked, ElementsAre("start k", "cancel o1", "delete o2"));
}

TEST_F(OperationClientTest, ListsReadPagesUpToTheLimit) {
  EXPECT_EQ(client_.List(3)->operations_size(), 4);  // the daemon's second page was larger than asked for
  EXPECT_THAT(operations_.limits, ElementsAre(3, 1));
  operations_.limits.clear();
  EXPECT_EQ(client_.List(0)->operations_size(), 6);
  EXPECT_THAT(operations_.limits, ElementsAre(0, 0, 0));
}

TEST_F(OperationClientTest, AWatchAnswersTheLastState) {
  std::vector<std::string> steps;
  const auto last = client_.Watch("o1", [&](const v1::Operation& now) { steps.push_back(now.step()); });
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_EQ(last->step(), "last");
  EXPECT_THAT(steps, ElementsAre("first", "last"));
  EXPECT_EQ(client_.Watch("o1", nullptr)->step(), "last");
  EXPECT_EQ(client_.Watch("gone", nullptr).status(), absl::NotFoundError("no operation gone"));
}

TEST_F(OperationClientTest, AWatchThatIsStoppedLeavesTheOperationAlone) {
  operations_.goes_on = true;
  std::stop_source stop;
  const absl::Status stopped =
      client_
          .Watch(
              "o1", [&](const v1::Operation&) { stop.request_stop(); }, stop.get_token())
          .status();
  EXPECT_EQ(stopped, absl::CancelledError("stopped watching; operation o1 goes on at " + daemon_.address()));
}

TEST_F(OperationClientTest, FetchesAllFilesIntoTheirFolders) {
  operations_.files = {"a.txt", "deep/er/b.txt", "broken"};
  ASSERT_TRUE(Fetch().ok());
  EXPECT_EQ(ReadBytes(folder_ / "out/a.txt"), "of a.txt");
  EXPECT_EQ(ReadBytes(folder_ / "out/deep/er/b.txt"), "of deep/er/b.txt");
  EXPECT_EQ(ReadBytes(folder_ / "out/broken"), "of broken");
  EXPECT_THAT(progress_, ElementsAre(std::pair(size_t{1}, size_t{3}), std::pair(size_t{2}, size_t{3}),
                                     std::pair(size_t{3}, size_t{3})));
  EXPECT_THAT(operations_.asked,
              ElementsAre("o1 a.txt 0 ", "o1 deep/er/b.txt 0 ", "o1 broken 0 ", "o1 broken 2 v1"));
}

TEST_F(OperationClientTest, WritesNothingOutsideOfTheFolder) {
  for (const char* path : {"", "/etc/passwd", "../out2/a", "a/../../b", ".."}) {
    operations_.files = {path};
    EXPECT_EQ(Fetch(),
              absl::DataLossError(std::string("the daemon names a file outside of its folder: ") + path));
  }
  EXPECT_TRUE(operations_.asked.empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace weft
