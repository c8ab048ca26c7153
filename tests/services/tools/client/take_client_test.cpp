#include "services/tools/client/take_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

// Says what it was asked.
class AnsweringTakes final : public v1::Takes::Service {
 public:
  std::vector<std::string> asked;
  bool goes_on = false;  // a watch does not end

 private:
  using Context = grpc::ServerContext;
  grpc::Status Answer(const std::string& call, const std::string& id, v1::RecordedTake* take) {
    asked.push_back(call + " " + id);
    take->set_id(id);
    return grpc::Status::OK;
  }
  grpc::Status StartTake(Context*, const v1::StartTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("start", request->idempotency_key(), out);
  }
  grpc::Status StopTake(Context*, const v1::StopTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("stop", request->take_id(), out);
  }
  grpc::Status DescribeTake(Context*, const v1::DescribeTakeRequest* request,
                            v1::RecordedTake* out) override {
    return Answer("describe", request->take_id(), out);
  }
  grpc::Status PinTake(Context*, const v1::PinTakeRequest* request, v1::RecordedTake* out) override {
    return Answer(request->pinned() ? "pin" : "unpin", request->take_id(), out);
  }
  grpc::Status DeleteTake(Context*, const v1::DeleteTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("delete", request->take_id(), out);
  }
  grpc::Status RestoreTake(Context*, const v1::RestoreTakeRequest* request, v1::RecordedTake* out) override {
    return Answer("restore", request->take_id(), out);
  }
  grpc::Status EmptyTrash(Context*, const v1::EmptyTrashRequest* request,
                          v1::EmptyTrashResponse* out) override {
    asked.push_back("empty " + request->take_id());
    out->set_takes(3);
    return grpc::Status::OK;
  }
  grpc::Status ListTakes(Context*, const v1::ListTakesRequest* request, v1::ListTakesResponse* out) override {
    asked.push_back(absl::StrCat(request->limit(), request->trash() ? " trash " : " ", request->words(), " ",
                                 request->page_token()));
    for (int i = 0; i < 4; ++i) out->add_takes();
    if (request->page_token().empty()) out->set_next_page_token("more");
    return grpc::Status::OK;
  }
  grpc::Status WatchTake(Context*, const v1::WatchTakeRequest* request,
                         grpc::ServerWriter<v1::RecordedTake>* out) override {
    if (request->take_id() == "gone") return {grpc::StatusCode::NOT_FOUND, "no take gone"};
    v1::RecordedTake take;
    take.set_id(request->take_id());
    take.set_timecode("first");
    while (out->Write(take) && goes_on) {
    }
    take.set_timecode("last");
    out->Write(take);
    return grpc::Status::OK;
  }
};

class TakeClientTest : public ::testing::Test {
 protected:
  AnsweringTakes takes_;
  AnsweringDaemon daemon_{{&takes_}};
  TakeClient client_{daemon_.client()};
};

TEST_F(TakeClientTest, CallsNameTheTake) {
  v1::StartTakeRequest start;
  start.set_idempotency_key("k");
  v1::DescribeTakeRequest describe;
  describe.set_take_id("t2");
  EXPECT_EQ(client_.Start(start)->id(), "k");
  EXPECT_EQ(client_.Stop("t1")->id(), "t1");
  EXPECT_EQ(client_.Describe(describe)->id(), "t2");
  EXPECT_EQ(client_.Pin("t3", true)->id(), "t3");
  EXPECT_EQ(client_.Pin("t4", false)->id(), "t4");
  EXPECT_EQ(client_.Delete("t5")->id(), "t5");
  EXPECT_EQ(client_.Restore("t6")->id(), "t6");
  EXPECT_EQ(client_.EmptyTrash("t7")->takes(), 3);
  EXPECT_THAT(takes_.asked, ElementsAre("start k", "stop t1", "describe t2", "pin t3", "unpin t4",
                                        "delete t5", "restore t6", "empty t7"));
}

TEST_F(TakeClientTest, ListsReadPagesUpToTheLimit) {
  EXPECT_EQ(client_.List(0)->takes_size(), 8);
  EXPECT_EQ(client_.List(4, true, "12A")->takes_size(), 4);
  EXPECT_THAT(takes_.asked, ElementsAre("100  ", "96  more", "4 trash 12A "));
}

TEST_F(TakeClientTest, AWatchAnswersTheLastState) {
  std::vector<std::string> seen;
  const auto last = client_.Watch("t1", [&](const v1::RecordedTake& now) { seen.push_back(now.timecode()); });
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_EQ(last->timecode(), "last");
  EXPECT_EQ(last->id(), "t1");
  EXPECT_THAT(seen, ElementsAre("first", "last"));
  EXPECT_EQ(client_.Watch("t1", nullptr)->timecode(), "last");
  EXPECT_EQ(client_.Watch("gone", nullptr).status(), absl::NotFoundError("no take gone"));
}

TEST_F(TakeClientTest, AWatchThatIsStoppedLeavesTheTakeAlone) {
  takes_.goes_on = true;
  std::stop_source stop;
  const absl::Status stopped =
      client_
          .Watch(
              "t1", [&](const v1::RecordedTake&) { stop.request_stop(); }, stop.get_token())
          .status();
  EXPECT_EQ(stopped, absl::CancelledError("stopped watching; take t1 goes on at " + daemon_.address()));
}

}  // namespace
}  // namespace weft
