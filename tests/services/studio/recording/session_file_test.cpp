#include "services/studio/recording/session_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/json_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

v1::Session TwoCameras() {
  v1::Session session;
  for (const auto& [id, device] : {std::pair{"left", "192.168.1.11"}, std::pair{"right", "192.168.1.12"}}) {
    v1::SessionCamera& camera = *session.add_cameras();
    camera.set_id(id);
    camera.mutable_gige()->set_device(device);
  }
  return session;
}

std::string FaultOf(const v1::Session& session) {
  const TempFolder folder;
  const std::string path = folder.path() + "/session.json";
  EXPECT_TRUE(WriteJsonFile(path, session).ok());
  const absl::Status status = ReadSession(path).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), HasSubstr(path));
  return std::string(status.message());
}

TEST(SessionFile, NamesTheFaultyField) {
  EXPECT_THAT(FaultOf({}), HasSubstr("the field cameras is empty"));
  v1::Session session = TwoCameras();
  session.mutable_cameras(1)->set_id("left");
  EXPECT_THAT(FaultOf(session), HasSubstr("cameras[1]: the id left occurs twice"));
  session.mutable_cameras(1)->set_id("../right");
  EXPECT_THAT(FaultOf(session), HasSubstr("cameras[1]: camera id \"../right\""));
  session = TwoCameras();
  session.mutable_cameras(0)->mutable_gige()->clear_device();
  EXPECT_THAT(FaultOf(session), HasSubstr("cameras[0] (id left): the field gige.device is missing"));
  session = TwoCameras();
  session.set_fps(-1);
  EXPECT_THAT(FaultOf(session), HasSubstr("fps must not be negative"));
  session.set_fps(30);
  session.set_tolerance_ms(20);
  EXPECT_THAT(FaultOf(session), HasSubstr("must be below half the period"));
  session = TwoCameras();
  session.mutable_trigger()->set_kind(v1::SESSION_TRIGGER_KIND_ACTION);
  EXPECT_THAT(FaultOf(session), HasSubstr("fps is missing"));
}

TEST(SessionFile, CamerasOfThisMachineHaveTheirOwnClock) {
  v1::Session session = TwoCameras();
  session.set_fps(30);
  v1::SessionCamera& camera = *session.add_cameras();
  camera.set_id("usb");
  EXPECT_THAT(FaultOf(session), HasSubstr("(id usb): it needs one of the fields gige, v4l2 and replay"));
  camera.mutable_v4l2()->set_format("YUYV");
  EXPECT_THAT(FaultOf(session), HasSubstr("the field v4l2.device is missing"));
  camera.mutable_v4l2()->set_device("/dev/video0");
  FrameSetOptions sets = RecordingOptionsOf(session)->sets;
  EXPECT_EQ(sets.clocks, ClockDomain::kShared);
  EXPECT_TRUE(sets.cameras[2].own_clock && !sets.cameras[0].own_clock);
  session.mutable_trigger()->set_kind(v1::SESSION_TRIGGER_KIND_SOFTWARE);
  EXPECT_THAT(FaultOf(session), HasSubstr("camera usb: V4L2 cameras take no triggers from Weft"));
  camera.set_unsynchronized(true);
  EXPECT_TRUE(RecordingOptionsOf(session)->sets.cameras[2].unsynchronized);
  session.mutable_cameras()->DeleteSubrange(0, 2);
  EXPECT_THAT(FaultOf(session), HasSubstr("at least one must define the triggers"));
  session.mutable_cameras(0)->set_unsynchronized(false);
  session.clear_trigger();
  EXPECT_EQ(RecordingOptionsOf(session)->sets.clocks, ClockDomain::kEstimated);
}

TEST(SessionFile, ToleranceFollowsTheRate) {
  v1::Session session = TwoCameras();
  EXPECT_EQ(RecordingOptionsOf(session)->sets.tolerance_ns, 2'000'000);
  session.set_fps(200);
  EXPECT_EQ(RecordingOptionsOf(session)->sets.period_ns, 5'000'000);
  EXPECT_EQ(RecordingOptionsOf(session)->sets.tolerance_ns, 1'000'000);
}

TEST(SessionFile, RefusesOneDeviceForTwoCameras) {
  v1::Session session;
  session.set_fps(10);
  for (const char* id : {"a", "b", "c"}) {
    v1::SessionCamera& camera = *session.add_cameras();
    camera.set_id(id);
    camera.mutable_gige()->set_device(id[0] == 'c' ? "192.168.7.11" : "192.168.7.12");
  }
  const absl::Status status = CheckSession(session, "session.json");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(std::string(status.message()),
            "session.json: cameras[1] (id b): the device 192.168.7.12 is that of camera a already");
}

}  // namespace
}  // namespace weft
