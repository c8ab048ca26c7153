// Operations of several callers, by a program that stands in for `weft`.
#include "services/server/daemon/work/operation_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

const Caller kUserOfQueue{"token 1 (anna)", v1::ROLE_CLIENT}, kBen{"token 2 (ben)", v1::ROLE_CLIENT},
    kOperator{"token 3 (stage)", v1::ROLE_OPERATOR};

class OperationQueueTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // Its last argument is the input. It waits while the test says so, and leaves files behind.
    WriteBytes(folder_ / "program",
               absl::StrCat("#!/bin/sh\nfor last; do :; done\necho \"${last##*/}\" >> '", folder_ / "began",
                            "'\nwhile [ -e '", folder_ / "wait",
                            "' ]; do sleep 0.05; done\nmkdir -p o/deep; echo 1 > o/deep/b; echo 22 > o/a; "
                            "ln -s /etc/passwd o/link\n"));
    std::filesystem::permissions(folder_ / "program", std::filesystem::perms::owner_all);
    Restart();
  }
  void Restart() {
    queue_.reset();
    OperationQueueOptions options;
    options.folder = folder_ / "operations";
    options.program = folder_ / "program";
    options.resolve = [](const std::string&, auto, const std::string& value) -> absl::StatusOr<std::string> {
      return std::filesystem::path(value).lexically_normal().string();
    };
    options.adopt_take = [](const std::string&, const std::string&) { return absl::OkStatus(); };
    auto queue = OperationQueue::Create(std::move(options));
    ASSERT_TRUE(queue.ok()) << queue.status();
    queue_ = *std::move(queue);
  }
  void Hold() { WriteBytes(folder_ / "wait", ""); }
  void LetGo() { std::filesystem::remove(folder_ / "wait"); }

  static v1::StartOperationRequest Request(const std::string& take) {
    v1::StartOperationRequest request;
    request.mutable_spec()->set_command("take verify");
    v1::OperationInput& input = *request.mutable_spec()->add_inputs();
    input.set_name("take");
    input.set_value(take);
    return request;
  }
  std::string Start(const Caller& caller, const std::string& take = "/takes/t") {
    const auto operation = queue_->Start(Request(take), caller);
    EXPECT_TRUE(operation.ok()) << operation.status();
    return operation.ok() ? operation->id() : "";
  }
  v1::Operation WaitForEnd(const std::string& id) {
    for (int i = 0; i < 400; ++i) {
      const auto operation = queue_->Get(id);
      if (operation.ok() && operation->finished_unix_ns() != 0) return *operation;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    ADD_FAILURE() << "operation " << id << " does not end";
    return {};
  }
  std::vector<std::string> Began() {
    return absl::StrSplit(ReadBytes(folder_ / "began"), '\n', absl::SkipEmpty());
  }

  const TempFolder folder_;
  std::unique_ptr<OperationQueue> queue_;
};

TEST_F(OperationQueueTest, CallersTakeTurns) {
  Hold();
  std::vector<std::string> ids;
  for (int i = 1; i <= 9; ++i) ids.push_back(Start(kBen, absl::StrCat("/b", i)));
  for (const char* take : {"/a1", "/a2"}) ids.push_back(Start(kUserOfQueue, take));
  LetGo();
  for (const std::string& id : ids) WaitForEnd(id);
  // By the time that each was served, which differs, on a busy machine by a multiple.
  const std::vector<std::string> order = Began();
  ASSERT_EQ(order.size(), 11U);
  EXPECT_EQ(order.front(), "b1");
  EXPECT_EQ(order[1], "a1");
  EXPECT_NE(order.back(), "a2");
}

TEST_F(OperationQueueTest, OneCallerLeavesPlacesForOthersAndForOperators) {
  Hold();
  int started = 0;
  absl::Status refused;
  for (; refused.ok() && started < 1000; ++started) refused = queue_->Start(Request("/b"), kBen).status();
  EXPECT_LE(started, 301);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("(ben) has 300 unfinished operations"));
  Start(kUserOfQueue);
  Start(kOperator);
}

TEST_F(OperationQueueTest, LongInputsHaveAShareOfTheirOwn) {
  Hold();
  v1::StartOperationRequest request = Request("/board");
  request.mutable_spec()->set_command("template build");
  request.mutable_spec()->set_out_name("o");
  request.mutable_spec()->mutable_inputs(0)->set_name("board");
  for (int i = 0; i < 240; ++i) {
    v1::OperationInput& input = *request.mutable_spec()->add_inputs();
    input.set_name("sources");
    input.set_value("/" + std::string(4000, 'x'));
  }
  int started = 0;
  while (started < 300 && queue_->Start(request, kBen).ok()) ++started;
  EXPECT_LT(started, 75);  // 64 MiB
  EXPECT_GT(started, 60);
  Start(kUserOfQueue);
}

TEST_F(OperationQueueTest, OwnersAndOperatorsCancelAndDelete) {
  Hold();
  const std::string id = Start(kUserOfQueue), other = Start(kUserOfQueue);
  const absl::Status refused = queue_->Cancel(id, kBen).status();
  EXPECT_TRUE(absl::IsPermissionDenied(refused));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("operation " + id + " belongs to token 1 (anna)"));
  EXPECT_TRUE(absl::IsPermissionDenied(queue_->Delete(id, kBen).status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(queue_->Delete(id, kUserOfQueue).status())) << "it runs";
  EXPECT_TRUE(queue_->Cancel(other, kOperator).ok());
  EXPECT_TRUE(queue_->Cancel(id, kUserOfQueue).ok());
  EXPECT_EQ(WaitForEnd(id).state(), v1::JOB_STATE_CANCELLED);
  EXPECT_TRUE(queue_->Delete(id, kUserOfQueue).ok());
  EXPECT_TRUE(queue_->Delete(other, kOperator).ok());
  EXPECT_TRUE(absl::IsNotFound(queue_->Get(id).status()));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "operations"));
  Restart();
  EXPECT_EQ(queue_->List(10)->operations_size(), 0);
}

TEST_F(OperationQueueTest, AKeyIsItsFirstCallersAlone) {
  v1::StartOperationRequest request = Request("/takes/t");
  request.set_idempotency_key("0123-weft");
  ASSERT_TRUE(queue_->Start(request, kUserOfQueue).ok());
  WaitForEnd("0123-weft");
  EXPECT_EQ(queue_->Start(request, {"token 9 (anna)", v1::ROLE_CLIENT})->id(), "0123-weft");
  EXPECT_TRUE(absl::IsAlreadyExists(queue_->Start(request, kBen).status()));
  EXPECT_TRUE(absl::IsAlreadyExists(queue_->Start(request, kOperator).status()));
  request.mutable_spec()->mutable_inputs(0)->set_value("/takes/other");
  EXPECT_TRUE(absl::IsAlreadyExists(queue_->Start(request, kUserOfQueue).status()));
}

TEST_F(OperationQueueTest, ListsAreShortAndComeInPages) {
  std::vector<std::string> ids;  // newest first
  v1::StartOperationRequest request = Request(absl::StrCat("/", std::string(3900, 'x'), "/last"));
  for (int i = 0; i < 5; ++i) {
    // A key that sorts before all ids: lists go by time.
    request.set_idempotency_key(absl::StrCat("0000000", 9 - i));
    ids.insert(ids.begin(), queue_->Start(request, kUserOfQueue)->id());
  }
  for (const std::string& id : ids) WaitForEnd(id);
  std::vector<std::string> listed;
  std::string token;
  do {
    const auto page = queue_->List(2, token);
    ASSERT_TRUE(page.ok());
    EXPECT_LT(page->ByteSizeLong(), 2000U);
    for (const v1::Operation& operation : page->operations()) {
      listed.push_back(operation.id());
      EXPECT_EQ(operation.spec().inputs_size(), 0);
      EXPECT_TRUE(absl::EndsWith(operation.about(), "/last"));
    }
    token = page->next_page_token();
  } while (!token.empty());
  EXPECT_EQ(listed, ids);
  EXPECT_EQ(queue_->Get(ids[0])->spec().inputs_size(), 1);
  Restart();
  EXPECT_EQ(queue_->Get(ids[0])->spec().inputs_size(), 1);
}

TEST_F(OperationQueueTest, PathsAreKeptAsTheyAreResolved) {
  v1::StartOperationRequest request = Request("/takes/./././../takes/t");
  v1::OperationSpec named = Request("take:20260101-000000-00000000").spec();
  EXPECT_EQ(queue_->Start(request, kUserOfQueue)->spec().inputs(0).value(), "/takes/t");
  *request.mutable_spec() = named;
  EXPECT_EQ(queue_->Start(request, kUserOfQueue)->spec().inputs(0).value(), "take:20260101-000000-00000000");
}

TEST_F(OperationQueueTest, FilesAreFoundByTheirPathsAlone) {
  const std::string id = Start(kUserOfQueue);
  WaitForEnd(id);
  v1::ListOperationFilesRequest request;
  request.set_operation_id(id);
  request.set_limit(1);
  const auto first = queue_->Files(request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->files_size(), 1);
  EXPECT_EQ(first->files(0).path(), "o/a");
  EXPECT_EQ(first->files(0).bytes(), 3);
  request.set_page_token(first->next_page_token());
  const auto second = queue_->Files(request);
  ASSERT_EQ(second->files_size(), 1);
  EXPECT_EQ(second->files(0).path(), "o/deep/b");
  EXPECT_EQ(second->next_page_token(), "");
  auto pieces = queue_->OpenFile(id, "o/deep/b", {});
  ASSERT_TRUE(pieces.ok()) << pieces.status();
  v1::FileChunk chunk;
  EXPECT_TRUE(pieces->Next(&chunk).value());
  EXPECT_EQ(chunk.data(), "1\n");
  for (const char* path :
       {"o/link", "o/deep", "o/none", "../operation.json", "/etc/passwd", "", "o/deep/../a"})
    EXPECT_TRUE(absl::IsNotFound(queue_->OpenFile(id, path, {}).status())) << path;
}

}  // namespace
}  // namespace weft
