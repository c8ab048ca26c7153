#include "services/studio/recording/session_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "services/formats/files/json_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

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

TEST(SessionFile, EveryFieldOfASetBecomesAnOption) {
  v1::Session session = TwoCameras();
  const LiveRecordingOptions usual = *RecordingOptionsOf(session);
  EXPECT_EQ(usual.sets.period_ns, 0);
  EXPECT_EQ(usual.sets.max_wait_ns, 500'000'000);
  EXPECT_EQ(usual.sets.start_wait_ns, 5'000'000'000);
  EXPECT_FALSE(usual.sets.drop_incomplete);
  EXPECT_FALSE(usual.recorder.take.stream.compress);
  EXPECT_EQ(usual.recorder.queue_bytes, RecorderOptions().queue_bytes);
  EXPECT_EQ(usual.recorder.low_disk_bytes, RecorderOptions().low_disk_bytes);
  EXPECT_EQ(usual.trigger.kind, TriggerKind::kFreeRun);
  session.set_fps(50);
  session.set_tolerance_ms(1.5);
  session.set_max_wait_ms(120);
  session.set_drop_incomplete(true);
  session.set_compress(true);
  session.set_queue_mib(3);
  session.set_low_disk_gib(0.5);
  session.set_clocks(v1::SESSION_CLOCKS_ESTIMATED);
  const LiveRecordingOptions options = *RecordingOptionsOf(session);
  EXPECT_EQ(options.sets.period_ns, 20'000'000);
  EXPECT_EQ(options.sets.tolerance_ns, 1'500'000);
  EXPECT_EQ(options.sets.max_wait_ns, 120'000'000);
  EXPECT_TRUE(options.sets.drop_incomplete);
  EXPECT_EQ(options.sets.clocks, ClockDomain::kEstimated);
  EXPECT_TRUE(options.recorder.take.stream.compress);
  EXPECT_EQ(options.recorder.queue_bytes, 3u << 20);
  EXPECT_EQ(options.recorder.low_disk_bytes, 1u << 29);
}

TEST(SessionFile, TheTriggerIsTheSessions) {
  v1::Session session = TwoCameras();
  session.set_fps(50);
  v1::SessionTrigger& trigger = *session.mutable_trigger();
  for (const auto& [field, kind] : {std::pair{v1::SESSION_TRIGGER_KIND_SOFTWARE, TriggerKind::kSoftware},
                                    std::pair{v1::SESSION_TRIGGER_KIND_LINE, TriggerKind::kLine},
                                    std::pair{v1::SESSION_TRIGGER_KIND_ACTION, TriggerKind::kAction}}) {
    trigger.set_kind(field);
    EXPECT_EQ(RecordingOptionsOf(session)->trigger.kind, kind);
  }
  TriggerOptions options = RecordingOptionsOf(session)->trigger;
  EXPECT_EQ(options.keys.device_key, 1u);
  EXPECT_EQ(options.keys.group_key, 1u);
  EXPECT_EQ(options.keys.group_mask, 1u);
  EXPECT_EQ(options.period_ns, 20'000'000);
  EXPECT_EQ(options.lead_ns, 20'000'000);
  EXPECT_EQ(options.clocks, ClockDomain::kShared);
  trigger.set_device_key(2);
  trigger.set_group_key(3);
  trigger.set_group_mask(4);
  trigger.set_lead_ms(1.25);
  options = RecordingOptionsOf(session)->trigger;
  EXPECT_EQ(options.keys.device_key, 2u);
  EXPECT_EQ(options.keys.group_key, 3u);
  EXPECT_EQ(options.keys.group_mask, 4u);
  EXPECT_EQ(options.lead_ns, 1'250'000);
  trigger.set_lead_ms(-1);
  EXPECT_THAT(FaultOf(session), HasSubstr("lead_ms must not be negative"));
}

// Hardware lines reach cameras of this machine too.
TEST(SessionFile, CamerasOfThisMachineMayFollowALine) {
  v1::Session session = TwoCameras();
  session.set_fps(30);
  v1::SessionCamera& camera = *session.add_cameras();
  camera.set_id("usb");
  camera.mutable_v4l2()->set_device("/dev/video0");
  session.mutable_trigger()->set_kind(v1::SESSION_TRIGGER_KIND_LINE);
  EXPECT_TRUE(RecordingOptionsOf(session).ok());
}

TEST(SessionFile, RefusesNumbersBelowZero) {
  v1::Session session = TwoCameras();
  session.set_tolerance_ms(-1);
  EXPECT_THAT(FaultOf(session), HasSubstr("tolerance_ms must not be negative"));
  session = TwoCameras();
  session.set_queue_mib(-1);
  EXPECT_THAT(FaultOf(session), HasSubstr("queue_mib must not be negative"));
}

TEST(SessionFile, ReplaysAreFoundBesideTheFile) {
  const TempFolder folder;
  v1::Session session;
  for (const auto& [id, take] :
       {std::pair{"a", "takes/../take"}, std::pair{"b", "/takes/b"}, std::pair{"c", "take:0f"}}) {
    v1::SessionCamera& camera = *session.add_cameras();
    camera.set_id(id);
    camera.mutable_replay()->set_take(take);
  }
  session.mutable_cameras(0)->mutable_replay()->set_speed(-1);
  EXPECT_THAT(FaultOf(session), HasSubstr("(id a): the field replay.speed is negative"));
  session.mutable_cameras(0)->mutable_replay()->clear_speed();
  session.mutable_cameras(1)->mutable_replay()->clear_take();
  EXPECT_THAT(FaultOf(session), HasSubstr("(id b): the field replay.take is missing"));
  session.mutable_cameras(1)->mutable_replay()->set_take("/takes/b");
  ASSERT_TRUE(WriteJsonFile(folder / "session.json", session).ok());
  const auto read = ReadSession(folder / "session.json");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(ReplayedTakesOf(*read),
              ::testing::UnorderedElementsAre(folder / "take", "/takes/b", "take:0f"));
  EXPECT_TRUE(DevicesOf(*read).empty());
  session = TwoCameras();
  session.add_cameras()->mutable_v4l2()->set_device("/dev/video0");
  EXPECT_THAT(DevicesOf(session), ::testing::ElementsAre("/dev/video0", "192.168.1.11", "192.168.1.12"));
  EXPECT_TRUE(ReplayedTakesOf(session).empty());
}

// Two cameras of one take, and one of it at another speed.
TEST(SessionFile, OpensReplaysOfOneTakeTogether) {
  const TempFolder folder;
  PatternFrames frames({"left", "right"}, 64, 48);
  RecordPattern(folder / "take", frames);
  v1::Session session;
  for (const char* id : {"left", "right"}) {
    v1::SessionCamera& camera = *session.add_cameras();
    camera.set_id(id);
    camera.mutable_replay()->set_take(folder / "take");
  }
  const auto cameras = OpenCameras(session);
  ASSERT_TRUE(cameras.ok()) << cameras.status();
  ASSERT_EQ(cameras->size(), 2u);
  EXPECT_EQ((*cameras)[1]->camera_id(), "right");
  session.mutable_cameras(1)->mutable_replay()->set_take(folder / "nothing");
  EXPECT_THAT(std::string(OpenCameras(session).status().message()), HasSubstr("camera right: "));
}

// What a camera's source refuses tells which of its options came from the session.
TEST(SessionFile, FieldsOfACameraBecomeItsOptions) {
  const auto why = [](const std::function<void(v1::Session&, v1::SessionCamera&)>& change) {
    v1::Session session;
    v1::SessionCamera& camera = *session.add_cameras();
    camera.set_id("c01");
    change(session, camera);
    return std::string(OpenCameras(session).status().message());
  };
  const auto gige = [&](const std::function<void(v1::Session&, v1::GigeCamera&)>& change) {
    return why([&](v1::Session& session, v1::SessionCamera& camera) {
      camera.mutable_gige()->set_device("192.0.2.1");
      change(session, *camera.mutable_gige());
    });
  };
  EXPECT_EQ(gige([](v1::Session&, v1::GigeCamera& c) { c.clear_device(); }),
            "a GigE Vision camera needs an id and a device");
  EXPECT_EQ(gige([](v1::Session&, v1::GigeCamera& c) { c.set_buffers(1); }),
            "camera c01: buffers must be at least 2");
  EXPECT_EQ(gige([](v1::Session& s, v1::GigeCamera&) { s.set_fps(-1); }),
            "camera c01: fps must not be negative");
  EXPECT_EQ(gige([](v1::Session&, v1::GigeCamera& c) { c.add_features("=3"); }),
            "camera c01: feature \"=3\" is not of the form Name=value");
  const auto v4l2 = [&](const std::function<void(v1::Session&, v1::V4l2Camera&)>& change) {
    return why([&](v1::Session& session, v1::SessionCamera& camera) {
      camera.mutable_v4l2()->set_device("/dev/no such camera");
      change(session, *camera.mutable_v4l2());
    });
  };
  EXPECT_THAT(v4l2([](v1::Session&, v1::V4l2Camera&) {}), HasSubstr("camera c01: /dev/no such camera"));
  EXPECT_EQ(v4l2([](v1::Session&, v1::V4l2Camera& c) { c.clear_device(); }),
            "a V4L2 camera needs an id and a device");
  EXPECT_EQ(v4l2([](v1::Session&, v1::V4l2Camera& c) { c.set_width_px(-1); }),
            "camera c01: width_px and height_px must not be negative");
  EXPECT_EQ(v4l2([](v1::Session&, v1::V4l2Camera& c) { c.set_height_px(-1); }),
            "camera c01: width_px and height_px must not be negative");
  EXPECT_EQ(v4l2([](v1::Session& s, v1::V4l2Camera&) { s.set_fps(-1); }),
            "camera c01: fps must not be negative");
  EXPECT_EQ(v4l2([](v1::Session&, v1::V4l2Camera& c) { c.set_buffers(33); }),
            "camera c01: buffers must be 2 to 32");
  EXPECT_EQ(v4l2([](v1::Session&, v1::V4l2Camera& c) { c.add_controls("=1"); }),
            "camera c01: a control is not of the form Name=value");
}

}  // namespace
}  // namespace weft
