#include "services/server/daemon/studio/session_service.h"

#include <grpcpp/grpcpp.h>

#include "services/tools/client/library_client.h"
#include "services/tools/client/session_client.h"
#include "services/work/items/item_files.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "weft/v1/sessions.grpc.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class SessionServiceTest : public DaemonTest {
 protected:
  SessionServiceTest() {
    options_.check_item = [](v1::ItemKind, const v1::ItemManifest&, const std::string&) {
      return absl::OkStatus();
    };
    StartDaemon();
    sessions_ = std::make_unique<SessionClient>(*client_);
  }
  static v1::OpenSessionRequest Request(const std::string& key, const std::string& device = "127.0.0.2") {
    v1::OpenSessionRequest request;
    v1::SessionCamera& camera = *request.mutable_cameras()->add_cameras();
    camera.set_id("left");
    camera.mutable_gige()->set_device(device);
    request.set_owner("anna");
    request.set_idempotency_key(key);
    return request;
  }
  std::unique_ptr<SessionClient> sessions_;
};

TEST_F(SessionServiceTest, NamesItemsOfTheLibraryByTheirContent) {
  WriteBytes(folder_ / "local/rig.json", "{}");
  const auto files = ListLocalItem(v1::ITEM_KIND_RIG, folder_ / "local/rig.json");
  const auto item = LibraryClient(*client_).Upload(v1::ITEM_KIND_RIG, "lab", *files);
  ASSERT_TRUE(item.ok()) << item.status();
  v1::OpenSessionRequest request = Request("session-of-anna");
  request.set_rig("library:lab");
  request.set_board(folder_ / "board.json");
  const auto session = sessions_->Open(request);
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_EQ(session->rig(), "library:sha256:" + item->id());
  EXPECT_EQ(session->board(), folder_ / "board.json");
  EXPECT_EQ(session->garment(), "");
  EXPECT_THAT(session->opened_by(), StartsWith("user "));
  EXPECT_EQ(session->lease_s(), 60);
  const struct {
    std::string field, value, words;
  } wrong[] = {
      {"rig", "library:hall", "rig: the library has no rig \"hall\"; it has lab@1"},
      {"board", "library:lab", "board: the library has no board \"lab\""},
      {"garment", "library:lab", "garment: the library has no template \"lab\""},
      {"garment", "/etc", "garment: /etc lies outside the folders that the daemon may use"},
  };
  for (const auto& c : wrong) {
    v1::OpenSessionRequest bad = Request("another-session", "127.0.0.3");
    const auto* field = bad.GetDescriptor()->FindFieldByName(c.field);
    bad.GetReflection()->SetString(&bad, field, c.value);
    EXPECT_THAT(std::string(sessions_->Open(bad).status().message()), HasSubstr(c.words));
  }
}

TEST_F(SessionServiceTest, AreShownRenewedAndListed) {
  const auto opened = sessions_->Open(Request("session-of-anna"));
  ASSERT_TRUE(opened.ok()) << opened.status();
  ASSERT_TRUE(sessions_->Open(Request("session-of-ben", "127.0.0.3")).ok());
  EXPECT_EQ(sessions_->Renew(opened->lease())->id(), "session-of-anna");
  EXPECT_EQ(sessions_->List(10)->sessions_size(), 2);
  const auto stub = v1::Sessions::NewStub(client_->channel());
  {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    request.set_session_id("session-of-anna");
    v1::CaptureSession session;
    ASSERT_TRUE(stub->GetSession(&context, request, &session).ok());
    EXPECT_GT(session.remaining_s(), 30);
    EXPECT_EQ(session.lease(), "");
  }
  grpc::ClientContext context;
  v1::ListSessionsRequest request;
  request.set_limit(-1);
  v1::ListSessionsResponse response;
  EXPECT_EQ(stub->ListSessions(&context, request, &response).error_message(),
            "limit: -1 is negative; give 0 for the default");
  request.set_limit(1);
  grpc::ClientContext again;
  ASSERT_TRUE(stub->ListSessions(&again, request, &response).ok());
  EXPECT_EQ(response.sessions_size(), 1);
  EXPECT_NE(response.next_page_token(), "");
  EXPECT_EQ(sessions_->Close(opened->lease())->state(), v1::CAPTURE_SESSION_STATE_CLOSED);
}

}  // namespace
}  // namespace weft
