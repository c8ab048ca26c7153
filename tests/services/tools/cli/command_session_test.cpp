// weft session: what is asked of a daemon, and what it answers in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <stdlib.h>
#include <unistd.h>

#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_aloud.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/sessions.grpc.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

class ToldSessions final : public v1::Sessions::Service {
 public:
  std::vector<std::string> asked;
  v1::OpenSessionRequest opened;
  v1::CaptureSession answer;
  v1::ListSessionsResponse list;
  grpc::Status renewed;

 private:
  using Context = grpc::ServerContext;
  grpc::Status OpenSession(Context*, const v1::OpenSessionRequest* request,
                           v1::CaptureSession* out) override {
    opened = *request;
    *out = answer;
    return grpc::Status::OK;
  }
  grpc::Status RenewSession(Context*, const v1::RenewSessionRequest* request,
                            v1::CaptureSession* out) override {
    asked.push_back("renew " + request->lease());
    *out = answer;
    return renewed;
  }
  grpc::Status CloseSession(Context*, const v1::CloseSessionRequest* request,
                            v1::CaptureSession* out) override {
    asked.push_back("close " + request->lease());
    *out = answer;
    return grpc::Status::OK;
  }
  grpc::Status ListSessions(Context*, const v1::ListSessionsRequest* request,
                            v1::ListSessionsResponse* out) override {
    asked.push_back("list " + TextOf(*request));
    *out = list;
    return grpc::Status::OK;
  }
};

class CommandSession : public ::testing::Test {
 protected:
  CommandSession() {
    unsetenv("WEFT_LEASE");
    WriteBytes(folder_ / "session.json",
               R"({"cameras": [{"id": "c01", "gige": {"device": "192.168.1.7"}}]})");
    sessions_.answer = FromText<v1::CaptureSession>(
        R"(id: "s1" lease: "l1" owner: "anna" state: CAPTURE_SESSION_STATE_OPEN lease_s: 0.03)");
  }
  AloudRun Session(std::vector<std::string> words) const {
    words.insert(words.begin(), "session");
    words.insert(words.end(), {"--server", daemon_.address()});
    return RunAloud(AddSessionCommand, std::move(words));
  }

  ToldSessions sessions_;
  AnsweringDaemon daemon_{{&sessions_}};
  const TempFolder folder_;
};

TEST_F(CommandSession, OpenSendsCamerasInputsAndOwner) {
  const AloudRun run =
      Session({"open", folder_ / "session.json", "--rig", folder_ / "a/../rig.json", "--board",
               "library:stripes", "--owner", "bert", "--lease-s", "90", "--take-over", "--detach"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, "l1\n");
  EXPECT_EQ(run.err, "");
  const std::string key = sessions_.opened.idempotency_key();
  EXPECT_NE(key, "");
  sessions_.opened.clear_idempotency_key();
  EXPECT_EQ(TextOf(sessions_.opened),
            "cameras { cameras { id: \"c01\" gige { device: \"192.168.1.7\" } } } rig: \"" +
                (folder_ / "rig.json") +
                "\" board: \"library:stripes\" owner: \"bert\" lease_s: 90 take_over: true");
  const AloudRun json = Session({"open", folder_ / "session.json", "--detach", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::CaptureSession>(json.out)), TextOf(sessions_.answer));
  EXPECT_EQ(sessions_.opened.lease_s(), 60);
  EXPECT_FALSE(sessions_.opened.take_over());
  EXPECT_NE(sessions_.opened.idempotency_key(), key);
  // Who is not named is user and machine.
  char host[256] = {};
  ASSERT_EQ(gethostname(host, sizeof host - 1), 0);
  const passwd* user = getpwuid(getuid());
  EXPECT_EQ(sessions_.opened.owner(),
            (user == nullptr ? std::string("somebody") : std::string(user->pw_name)) + " at " + host);
  EXPECT_THAT(sessions_.asked, testing::IsEmpty());
}

TEST_F(CommandSession, OpenStaysAndRenewsTheLease) {
  sessions_.renewed = grpc::Status(grpc::StatusCode::NOT_FOUND, "taken over");
  const AloudRun run = Session({"open", folder_ / "session.json"});
  EXPECT_EQ(run.status, absl::NotFoundError("taken over"));
  EXPECT_EQ(run.out, "l1\n");
  EXPECT_EQ(run.err,
            "the session is open until this command is stopped (Ctrl-C); takes are started with\n"
            "  weft take start --lease l1 --server " +
                daemon_.address() + "\n");
  EXPECT_THAT(sessions_.asked, ElementsAre("renew l1"));
  EXPECT_EQ(Session({"open", folder_ / "none.json"}).status.code(), absl::StatusCode::kNotFound);
}

TEST_F(CommandSession, RenewAndCloseAnswerTheSession) {
  EXPECT_EQ(Session({"renew", "l1"}).out, "s1  open, of anna\n");
  sessions_.answer.set_state(v1::CAPTURE_SESSION_STATE_UNSPECIFIED);
  EXPECT_EQ(Session({"close", "l2"}).out, "s1  closed, of anna\n");
  const AloudRun json = Session({"close", "l3", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::CaptureSession>(json.out)), TextOf(sessions_.answer));
  setenv("WEFT_LEASE", "of the environment", 1);
  EXPECT_TRUE(Session({"renew"}).status.ok());
  unsetenv("WEFT_LEASE");
  EXPECT_EQ(Session({"renew"}).status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(sessions_.asked, ElementsAre("renew l1", "close l2", "close l3", "renew of the environment"));
}

TEST_F(CommandSession, ListsWhatTheyAreAndHowLong) {
  sessions_.list = FromText<v1::ListSessionsResponse>(R"(
    warnings: "s9 cannot be read"
    sessions { id: "s2" state: CAPTURE_SESSION_STATE_OPEN owner: "anna" remaining_s: 41.6 cameras { cameras {} cameras {} } }
    sessions { id: "s1" state: CAPTURE_SESSION_STATE_TAKEN_OVER owner: "bert" remaining_s: 7 ended_by: "anna" })");
  const AloudRun run = Session({"list", "--limit", "5"});
  EXPECT_EQ(run.out,
            "s2  open        2 cameras  anna, its lease lasts 42 s more\n"
            "s1  taken over  0 cameras  bert, by anna\n");
  EXPECT_EQ(run.err, "weft: warning: s9 cannot be read\n");
  const AloudRun json = Session({"list", "--json"});
  EXPECT_EQ(TextOf(FromJson<v1::ListSessionsResponse>(json.out)), TextOf(sessions_.list));
  EXPECT_EQ(json.err, "");
  sessions_.list.Clear();
  EXPECT_EQ(Session({"list"}).out, "no sessions at " + daemon_.address() + "\n");
  EXPECT_THAT(sessions_.asked, ElementsAre("list limit: 5", "list limit: 20", "list limit: 20"));
}

}  // namespace
}  // namespace weft
