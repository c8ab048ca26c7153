// Leases by a clock of the test's own.
#include "services/server/daemon/studio/session_registry.h"

#include <gmock/gmock.h>

#include <map>
#include <utility>

#include "base/host_clock.h"
#include "services/formats/files/json_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

const Caller kAnna{"token 1 (anna)", v1::ROLE_OPERATOR};

class SessionRegistryTest : public ::testing::Test {
 protected:
  SessionRegistryTest() { Restart(); }

  // The next daemon on the folder.
  void Restart() {
    auto keeper = SessionRegistry::Create(folder_ / "sessions", [this] { return now_; });
    ASSERT_TRUE(keeper.ok()) << keeper.status();
    keeper_ = *std::move(keeper);
  }

  static v1::OpenSessionRequest Request(const std::vector<std::string>& devices,
                                        const std::string& owner = "anna") {
    v1::OpenSessionRequest request;
    for (const std::string& device : devices) {
      v1::SessionCamera& camera = *request.mutable_cameras()->add_cameras();
      camera.set_id("of-" + device);
      camera.mutable_gige()->set_device(device);
    }
    request.set_owner(owner);
    request.set_lease_s(60);
    return request;
  }

  v1::CaptureSession Open(const v1::OpenSessionRequest& request) {
    const absl::StatusOr<v1::CaptureSession> session = keeper_->Open(request, kAnna);
    EXPECT_TRUE(session.ok()) << session.status();
    return session.ok() ? *session : v1::CaptureSession();
  }

  v1::CaptureSessionState StateOf(const v1::CaptureSession& session) {
    const absl::StatusOr<v1::CaptureSession> now = keeper_->Get(session.id());
    EXPECT_TRUE(now.ok()) << now.status();
    return now.ok() ? now->state() : v1::CAPTURE_SESSION_STATE_UNSPECIFIED;
  }

  const TempFolder folder_;
  SessionRegistry::Clock::time_point now_ = SessionRegistry::Clock::now();
  std::unique_ptr<SessionRegistry> keeper_;
};

TEST_F(SessionRegistryTest, OneOwnerAtATimeHasACamera) {
  const v1::CaptureSession first = Open(Request({"a", "b"}));
  const absl::Status refused = keeper_->Open(Request({"b", "c"}, "ben"), kAnna).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("camera b belongs to session " + first.id() +
                                                        " of anna, whose lease lasts 60 s more"));
  EXPECT_EQ(StateOf(Open(Request({"c"}, "ben"))), v1::CAPTURE_SESSION_STATE_OPEN);

  // Who has the lease may; who knows the id may not.
  EXPECT_TRUE(absl::IsPermissionDenied(keeper_->Close(first.id()).status()));
  EXPECT_TRUE(absl::IsPermissionDenied(keeper_->Close(first.lease() + "0").status()));
  EXPECT_TRUE(absl::IsPermissionDenied(keeper_->Renew("").status()));
  EXPECT_EQ(keeper_->Get(first.id())->lease(), "");
  EXPECT_EQ(keeper_->List(10)->sessions(1).lease(), "");
  EXPECT_TRUE(keeper_->Close(first.lease()).ok());
  EXPECT_TRUE(keeper_->Close(first.lease()).ok()) << "may be repeated";
  EXPECT_TRUE(absl::IsFailedPrecondition(keeper_->Renew(first.lease()).status()));
  Open(Request({"a", "b"}, "ben"));
}

TEST_F(SessionRegistryTest, ALeaseEndsWhenItsOwnerIsGone) {
  const v1::CaptureSession session = Open(Request({"a"}));
  for (int i = 0; i < 5; ++i) {
    now_ += seconds(40);
    ASSERT_TRUE(keeper_->Renew(session.lease()).ok());
  }
  now_ += seconds(59);
  EXPECT_EQ(StateOf(session), v1::CAPTURE_SESSION_STATE_OPEN);
  EXPECT_TRUE(keeper_->UsersOfDevices().contains("a"));
  now_ += seconds(1);
  EXPECT_EQ(StateOf(session), v1::CAPTURE_SESSION_STATE_EXPIRED);
  EXPECT_TRUE(keeper_->UsersOfDevices().empty());
  const absl::Status late = keeper_->Renew(session.lease()).status();
  EXPECT_THAT(std::string(late.message()), HasSubstr("has expired"));
  Restart();
  EXPECT_EQ(StateOf(session), v1::CAPTURE_SESSION_STATE_EXPIRED);
}

TEST_F(SessionRegistryTest, WhoTakesOverIsNamed) {
  const v1::CaptureSession first = Open(Request({"a", "b"}));
  v1::OpenSessionRequest request = Request({"b"}, "ben");
  request.set_take_over(true);
  Open(request);
  EXPECT_EQ(StateOf(first), v1::CAPTURE_SESSION_STATE_TAKEN_OVER);
  EXPECT_THAT(std::string(keeper_->Renew(first.lease()).status().message()),
              HasSubstr("was taken over by ben"));
}

TEST_F(SessionRegistryTest, GoesOnWithTheNextDaemonAndAWholeLease) {
  const v1::CaptureSession session = Open(Request({"a"}));
  now_ += seconds(50);
  Restart();
  now_ += seconds(50);
  EXPECT_TRUE(keeper_->Renew(session.lease()).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(keeper_->Open(Request({"a"}, "ben"), kAnna).status()));
  WriteBytes(folder_ / "sessions/damaged.json", "{");
  WriteBytes(folder_ / "sessions/copied.json", ReadBytes(folder_ / ("sessions/" + session.id() + ".json")));
  Restart();
  EXPECT_EQ(StateOf(session), v1::CAPTURE_SESSION_STATE_OPEN);
  const v1::ListSessionsResponse list = *keeper_->List(10);
  EXPECT_EQ(list.sessions_size(), 1);
  EXPECT_THAT(list.warnings(), UnorderedElementsAre(HasSubstr("damaged.json"), HasSubstr("copied.json")));
}

TEST_F(SessionRegistryTest, ARepeatedRequestGetsTheSameSession) {
  v1::OpenSessionRequest request = Request({"a"});
  request.set_idempotency_key("stage-2-monday");
  const v1::CaptureSession first = Open(request);
  EXPECT_EQ(first.id(), "stage-2-monday");
  EXPECT_EQ(Open(request).lease(), first.lease());
  for (const char* field : {"owner", "rig", "board", "garment"}) {
    v1::OpenSessionRequest other = request;
    other.GetReflection()->SetString(&other, other.GetDescriptor()->FindFieldByName(field), "another");
    EXPECT_TRUE(absl::IsAlreadyExists(keeper_->Open(other, kAnna).status())) << field;
  }
  request.mutable_cameras()->set_fps(30);
  EXPECT_TRUE(absl::IsAlreadyExists(keeper_->Open(request, kAnna).status()));
}

TEST_F(SessionRegistryTest, OnlyAKeysFirstCallerGetsTheLeaseAgain) {
  v1::OpenSessionRequest request = Request({"a"});
  const v1::CaptureSession first = Open(request);
  // What everybody sees of it.
  const v1::CaptureSession seen = keeper_->List(10)->sessions(0);
  v1::OpenSessionRequest copied;
  *copied.mutable_cameras() = seen.cameras();
  copied.set_owner(seen.owner());
  copied.set_idempotency_key(seen.id());
  for (const Caller& other :
       {Caller{"token 2 (ben)", v1::ROLE_OPERATOR}, Caller{"user root", v1::ROLE_ADMIN}, Caller{}}) {
    const auto refused = keeper_->Open(copied, other);
    EXPECT_TRUE(absl::IsAlreadyExists(refused.status())) << refused.status();
    EXPECT_EQ(std::string(refused.status().message()).find(first.lease()), std::string::npos);
  }
  Restart();
  EXPECT_FALSE(keeper_->Open(copied, {"token 2 (ben)", v1::ROLE_OPERATOR}).ok());
  EXPECT_EQ(keeper_->Open(copied, {"token 3 (anna)", v1::ROLE_OPERATOR})->lease(), first.lease());
}

TEST_F(SessionRegistryTest, HasAllThatWasAskedFor) {
  v1::OpenSessionRequest request = Request({"a"});
  request.set_idempotency_key("session-of-anna");
  request.set_rig("/rig");
  request.set_board("/board");
  request.set_garment("/shirt");
  request.set_lease_s(0);
  const int64_t before_ns = HostTime_ns();
  v1::CaptureSession session = Open(request);
  EXPECT_THAT(session.lease(), ::testing::MatchesRegex("session-of-anna\\.[0-9a-f]{32}"));
  EXPECT_GE(session.opened_unix_ns(), before_ns);
  EXPECT_LE(session.opened_unix_ns(), HostTime_ns());
  session.clear_lease();
  session.clear_opened_unix_ns();
  EXPECT_EQ(
      session.ShortDebugString(),
      "id: \"session-of-anna\" cameras { cameras { id: \"of-a\" gige { device: \"a\" } } } rig: \"/rig\" "
      "board: \"/board\" garment: \"/shirt\" owner: \"anna\" state: CAPTURE_SESSION_STATE_OPEN lease_s: 60 "
      "remaining_s: 60 opened_by: \"token 1 (anna)\"");
  EXPECT_EQ(keeper_->UsersOfDevices(),
            (std::map<std::string, std::string>{{"a", "session session-of-anna of anna"}}));
  v1::OpenSessionRequest second = Request({"a"}, "ben");
  second.set_take_over(true);
  Open(second);
  const v1::CaptureSession ended = *keeper_->Get("session-of-anna");
  EXPECT_EQ(ended.ended_by(), "ben");
  EXPECT_GE(ended.ended_unix_ns(), before_ns);
  EXPECT_EQ(ended.remaining_s(), 0);
  EXPECT_THAT(std::string(keeper_->Get("other").status().message()),
              HasSubstr("session_id: no session \"other\"; `weft session list` shows them"));
  EXPECT_THAT(std::string(keeper_->Renew("other").status().message()),
              HasSubstr("lease: fits no session; give the lease that OpenSession answered"));
}

TEST_F(SessionRegistryTest, LeasesAreRenewedToTheirWholeLengthAndHaveLimits) {
  v1::OpenSessionRequest request = Request({"a"});
  for (const double lease_s : {5.0, 7.0 * 24 * 3600}) {
    request.set_lease_s(lease_s);
    const v1::CaptureSession session = Open(request);
    now_ += seconds(2);
    EXPECT_EQ(keeper_->Get(session.id())->remaining_s(), lease_s - 2);
    EXPECT_EQ(keeper_->Renew(session.lease())->remaining_s(), lease_s);
    EXPECT_EQ(keeper_->Close(session.lease())->state(), v1::CAPTURE_SESSION_STATE_CLOSED);
    EXPECT_THAT(std::string(keeper_->Renew(session.lease()).status().message()),
                HasSubstr(" was closed; open a new one"));
  }
  for (const double lease_s : {4.9, 7.0 * 24 * 3600 + 1}) {
    request.set_lease_s(lease_s);
    EXPECT_THAT(std::string(keeper_->Open(request, kAnna).status().message()),
                HasSubstr(" is out of range; give 5 to 604800 seconds, or 0 for 60"));
  }
  // A file may say anything.
  request.set_lease_s(60);
  const v1::CaptureSession session = Open(request);
  const std::string file = folder_ / ("sessions/" + session.id() + ".json");
  for (const auto& [written_s, kept_s] : {std::pair(1e30, 7.0 * 24 * 3600), {-1e30, 0.0}}) {
    v1::CaptureSession stored;
    ASSERT_TRUE(ReadJsonFile(file, stored).ok());
    stored.set_lease_s(written_s);
    ASSERT_TRUE(WriteJsonFile(file, stored).ok());
    Restart();
    const v1::CaptureSession now = *keeper_->Get(session.id());
    EXPECT_EQ(now.remaining_s(), kept_s);
    EXPECT_EQ(now.state(), kept_s > 0 ? v1::CAPTURE_SESSION_STATE_OPEN : v1::CAPTURE_SESSION_STATE_EXPIRED);
  }
}

TEST_F(SessionRegistryTest, OneCallerLeavesSessionsForOthers) {
  for (int i = 0; i < 300; ++i) Open(Request({"d" + std::to_string(i)}));
  EXPECT_EQ(keeper_->Open(Request({"one-more"}), kAnna).status().code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(keeper_->Open(Request({"another"}), {"token 2 (ben)", v1::ROLE_OPERATOR}).ok());
}

TEST_F(SessionRegistryTest, ListsComeInPages) {
  for (const char* device : {"a", "b", "c"}) Open(Request({device}));
  const auto first = keeper_->List(2);
  ASSERT_EQ(first->sessions_size(), 2);
  const auto second = keeper_->List(2, first->next_page_token());
  ASSERT_EQ(second->sessions_size(), 1);
  EXPECT_EQ(second->next_page_token(), "");
  EXPECT_EQ(keeper_->List(2, "a\nb").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_GT(first->sessions(1).opened_unix_ns(), second->sessions(0).opened_unix_ns());
}

TEST_F(SessionRegistryTest, RefusesRequestsThatAreWrongByTheField) {
  const auto refused = [&](const v1::OpenSessionRequest& request) {
    const absl::Status status = keeper_->Open(request, kAnna).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    return std::string(status.message());
  };
  EXPECT_THAT(refused(Request({})), HasSubstr("cameras"));
  EXPECT_THAT(refused(Request({"a"}, "")), HasSubstr("owner"));
  EXPECT_THAT(refused(Request({"a"}, "an\nna")), HasSubstr("owner"));
  for (const double lease_s : {-1.0, 0.1, 1e9, std::nan("")}) {
    v1::OpenSessionRequest request = Request({"a"});
    request.set_lease_s(lease_s);
    EXPECT_THAT(refused(request), HasSubstr("lease_s"));
  }
  v1::OpenSessionRequest request = Request({"a"});
  request.set_idempotency_key("../../elsewhere");
  EXPECT_THAT(refused(request), HasSubstr("idempotency_key"));
  EXPECT_TRUE(absl::IsNotFound(keeper_->Get("unknown").status()));
}

}  // namespace
}  // namespace weft
