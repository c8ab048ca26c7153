#include "services/tools/client/session_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/sessions.grpc.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

class AnsweringSessions final : public v1::Sessions::Service {
 public:
  std::vector<std::string> asked;
  std::function<grpc::Status(int call)> renew = [](int) { return grpc::Status::OK; };
  std::atomic<int> renewed = 0;

 private:
  using Context = grpc::ServerContext;
  grpc::Status OpenSession(Context*, const v1::OpenSessionRequest* request,
                           v1::CaptureSession* out) override {
    out->set_id(request->idempotency_key());
    return grpc::Status::OK;
  }
  grpc::Status RenewSession(Context*, const v1::RenewSessionRequest* request,
                            v1::CaptureSession* out) override {
    out->set_id("of " + request->lease());
    return renew(++renewed);
  }
  grpc::Status CloseSession(Context*, const v1::CloseSessionRequest* request,
                            v1::CaptureSession* out) override {
    out->set_id("closed " + request->lease());
    return grpc::Status::OK;
  }
  grpc::Status ListSessions(Context*, const v1::ListSessionsRequest* request,
                            v1::ListSessionsResponse* out) override {
    asked.push_back(absl::StrCat(request->limit(), " ", request->page_token()));
    out->add_sessions();
    if (request->page_token().empty()) out->set_next_page_token("more");
    return grpc::Status::OK;
  }
};

class SessionClientTest : public ::testing::Test {
 protected:
  SessionClientTest() { session_.set_lease_s(0.3); }

  AnsweringSessions sessions_;
  AnsweringDaemon daemon_{{&sessions_}};
  SessionClient client_{daemon_.client()};
  v1::CaptureSession session_;
};

TEST_F(SessionClientTest, CallsNameTheLease) {
  v1::OpenSessionRequest request;
  request.set_idempotency_key("k");
  EXPECT_EQ(client_.Open(request)->id(), "k");
  EXPECT_EQ(client_.Renew("l1")->id(), "of l1");
  EXPECT_EQ(client_.Close("l2")->id(), "closed l2");
  EXPECT_EQ(client_.List(0)->sessions_size(), 2);
  EXPECT_EQ(client_.List(1)->sessions_size(), 1);
  EXPECT_THAT(sessions_.asked, ElementsAre("0 ", "0 more", "1 "));
}

TEST_F(SessionClientTest, HoldsASessionUntilItIsStopped) {
  std::stop_source stop;
  sessions_.renew = [&](int call) {
    if (call == 3) stop.request_stop();
    return grpc::Status::OK;
  };
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(client_.Hold(session_, "l1", stop.get_token()).ok());
  EXPECT_EQ(sessions_.renewed, 3);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(295))
      << "a third of the lease each";
}

TEST_F(SessionClientTest, ASessionThatOthersEndedIsNotHeld) {
  sessions_.renew = [](int call) {
    return call < 2 ? grpc::Status::OK : grpc::Status(grpc::StatusCode::NOT_FOUND, "taken over");
  };
  EXPECT_EQ(client_.Hold(session_, "l1", {}), absl::NotFoundError("taken over"));
  EXPECT_EQ(sessions_.renewed, 2);
}

}  // namespace
}  // namespace weft
