// Looks at cameras: of a take, and of cameras that are opened for a moment by the real recorder.
#include "services/server/daemon/studio/camera_service.h"

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/tools/client/camera_client.h"
#include "services/tools/client/session_client.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CameraServiceTest : public DaemonTest {
 protected:
  CameraServiceTest() {
    options_.recorder_program = WEFT_RECORDER;
    const RecorderFiles files(folder_ / "state/takes/20260101-000000-00000000");
    std::filesystem::create_directories(folder_ / "state/takes/20260101-000000-00000000");
    PatternFrames frames({"left", "right"}, 640, 480);
    RecordPattern(files.take, frames);
    v1::RecorderState state;
    state.set_phase(v1::RECORDER_PHASE_ENDED);
    EXPECT_TRUE(WriteJsonFile(files.request, v1::RecorderRequest()).ok());
    EXPECT_TRUE(WriteJsonFile(files.state, state).ok());
    StartDaemon();
  }
  static v1::Session Replaying(const std::string& take) {
    v1::Session session;
    session.set_fps(30);
    for (const char* id : {"left", "right"}) {
      v1::SessionCamera& camera = *session.add_cameras();
      camera.set_id(id);
      camera.mutable_replay()->set_take(take);
    }
    return session;
  }
  std::vector<v1::CameraLook> Look(const v1::LookAtCamerasRequest& request) {
    const auto looks = CameraClient(*client_).Look(request);
    EXPECT_TRUE(looks.ok()) << looks.status();
    return looks.ok() ? *looks : std::vector<v1::CameraLook>();
  }
  static std::vector<std::string> CamerasOf(const std::vector<v1::CameraLook>& looks) {
    std::vector<std::string> ids;
    for (const v1::CameraLook& look : looks) ids.push_back(look.camera().id());
    return ids;
  }
  const std::string id_ = "20260101-000000-00000000";
};

TEST_F(CameraServiceTest, LooksAtATake) {
  v1::LookAtCamerasRequest request;
  request.set_take_id(id_);
  const std::vector<v1::CameraLook> newest = Look(request);
  EXPECT_THAT(CamerasOf(newest), ElementsAre("left", "right"));
  EXPECT_FALSE(newest[0].jpeg().empty());
  request.set_width_px(64);
  EXPECT_LT(Look(request)[0].jpeg().size(), newest[0].jpeg().size()) << "a smaller picture";
  request.set_camera_id("right");
  EXPECT_THAT(CamerasOf(Look(request)), ElementsAre("right"));
  EXPECT_EQ(Look(request)[0].set(), 8u) << "the newest";
  request.set_frame("0006");
  request.set_camera_id("left");
  EXPECT_EQ(Look(request)[0].set(), 6u);
  request.set_camera_id("none");
  EXPECT_EQ(CameraClient(*client_).Look(request).status().code(), absl::StatusCode::kNotFound);
  request.set_take_id("20260101-000000-11111111");
  EXPECT_EQ(CameraClient(*client_).Look(request).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(CameraServiceTest, RefusesRequestsThatAreWrongByTheField) {
  const auto refused = [this](auto change) {
    v1::LookAtCamerasRequest request;
    change(request);
    const absl::Status status = CameraClient(*client_).Look(request).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    return std::string(status.message());
  };
  EXPECT_EQ(refused([](auto&) {}), "cameras: 0 of cameras, lease and take_id are given; give one of them");
  EXPECT_EQ(refused([](auto& request) {
              request.mutable_cameras(), request.set_lease("x"), request.set_take_id("y");
            }),
            "cameras: 3 of cameras, lease and take_id are given; give one of them");
  EXPECT_EQ(refused([](auto& request) { request.mutable_cameras(), request.set_frame("0006"); }),
            "frame: is given without a take; leave it out, or give take_id");
  for (const int width : {-1, 4097}) {
    EXPECT_EQ(refused([&](auto& request) { request.set_take_id("y"), request.set_width_px(width); }),
              absl::StrCat("width_px: ", width, " is out of range; give 1 to 4096, or 0"));
  }
  EXPECT_THAT(refused([](auto& request) { request.mutable_cameras(); }), HasSubstr("cameras"));
  EXPECT_EQ(refused([](auto& request) {
              *request.mutable_cameras() = Replaying("/take");
              request.set_camera_id("top");
            }),
            "camera_id: no camera \"top\"; give the id of a camera");
  v1::LookAtCamerasRequest request;
  request.set_take_id(id_);
  request.set_width_px(4096);
  EXPECT_EQ(Look(request).size(), 2u);
  request.set_take_id("");
  request.set_lease("none");
  EXPECT_EQ(CameraClient(*client_).Look(request).status().code(), absl::StatusCode::kPermissionDenied);
}

TEST_F(CameraServiceTest, FilmsCamerasForAMoment) {
  v1::LookAtCamerasRequest request;
  *request.mutable_cameras() = Replaying("take:" + id_);
  EXPECT_THAT(CamerasOf(Look(request)), ElementsAre("left", "right"));
  // One of a session, by its lease; alone it follows nobody's triggers.
  SessionClient sessions(*client_);
  v1::OpenSessionRequest open;
  *open.mutable_cameras() = request.cameras();
  open.mutable_cameras()->mutable_cameras(1)->set_unsynchronized(true);
  open.set_owner("anna");
  open.set_idempotency_key("session-of-anna");
  const auto session = sessions.Open(open);
  ASSERT_TRUE(session.ok()) << session.status();
  request.Clear();
  request.set_lease(session->lease());
  request.set_camera_id("right");
  EXPECT_THAT(CamerasOf(Look(request)), ElementsAre("right"));
  ASSERT_TRUE(sessions.Close(session->lease()).ok());
  EXPECT_EQ(CameraClient(*client_).Look(request).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(CameraServiceTest, OpensNoCameraOfAnotherSession) {
  SessionClient sessions(*client_);
  v1::OpenSessionRequest open;
  v1::SessionCamera& camera = *open.mutable_cameras()->add_cameras();
  camera.set_id("left");
  camera.mutable_gige()->set_device("127.0.0.2");
  open.set_owner("anna");
  open.set_idempotency_key("session-of-anna");
  ASSERT_TRUE(sessions.Open(open).ok());
  v1::LookAtCamerasRequest request;
  *request.mutable_cameras() = open.cameras();
  EXPECT_THAT(std::string(CameraClient(*client_).Look(request).status().message()),
              HasSubstr("cameras.cameras: camera 127.0.0.2 belongs to session session-of-anna of anna"));
  EXPECT_TRUE(CameraClient(*client_).List().ok());
}

}  // namespace
}  // namespace weft
