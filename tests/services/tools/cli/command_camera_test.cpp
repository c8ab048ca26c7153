// weft camera list, look.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/cameras.grpc.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// One camera that has a picture, one that has none.
class TwoCameras final : public v1::Cameras::Service {
 public:
  std::string asked, lease;

 private:
  grpc::Status ListCameras(grpc::ServerContext*, const v1::ListCamerasRequest*,
                           v1::CameraList* list) override {
    v1::ListedCamera& camera = *list->add_cameras();
    camera.set_kind("gige");
    camera.set_device("10.0.0.7");
    camera.set_model("Blackfly");
    camera.set_used_by("take walk");
    camera.add_formats("YUYV 640x480");
    return grpc::Status::OK;
  }
  grpc::Status LookAtCameras(grpc::ServerContext*, const v1::LookAtCamerasRequest* request,
                             grpc::ServerWriter<v1::CameraLook>* out) override {
    asked = request->ShortDebugString();
    lease = request->lease();
    v1::CameraLook look;
    v1::TakeCamera& camera = *look.mutable_camera();
    camera.set_id("left");
    camera.set_model("Blackfly");
    camera.set_width_px(2048);
    camera.set_height_px(1536);
    camera.set_pixel_format("BayerRG8");
    look.set_median_value(90);
    look.set_clipped_share(0.015);
    look.set_dark_share(0.25);
    look.set_focus(0.125);
    look.set_jpeg("a jpeg");
    out->Write(look);
    v1::CameraLook missing;
    missing.mutable_camera()->set_id("right");
    missing.set_problem("it does not answer");
    out->Write(missing);
    return grpc::Status::OK;
  }
};

class CommandCamera : public ::testing::Test {
 protected:
  CommandRun Camera(std::vector<std::string> words) {
    words.insert(words.begin(), "camera");
    words.insert(words.end(), {"--server", daemon_.address()});
    return RunCommand(AddCameraCommand, std::move(words));
  }

  const TempFolder folder_;
  TwoCameras cameras_;
  AnsweringDaemon daemon_{{&cameras_}};
};

TEST_F(CommandCamera, ListsTheCamerasOfADaemon) {
  const CommandRun run = Camera({"list"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("10.0.0.7"));
  EXPECT_THAT(run.out, HasSubstr("take walk"));
  EXPECT_EQ(run.out.find("YUYV"), std::string::npos);
  EXPECT_THAT(Camera({"list", "--details"}).out, HasSubstr("YUYV 640x480"));
  v1::CameraList list;
  ASSERT_TRUE(ParseJson(Camera({"list", "--json"}).out, "list", list).ok());
  ASSERT_EQ(list.cameras_size(), 1);
  EXPECT_EQ(list.cameras(0).device(), "10.0.0.7");
}

TEST_F(CommandCamera, TellsHowPicturesAreExposed) {
  const CommandRun run = Camera({"look", "--take", "walk"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(
      run.out,
      "left  Blackfly, 2048 x 1536, BayerRG8, median 90 of 255, 1.5 % clipped, 25.0 % dark, focus 0.1250\n"
      "right  no picture: it does not answer\n");
  EXPECT_EQ(cameras_.asked, "take_id: \"walk\" width_px: 640");
}

TEST_F(CommandCamera, WritesThePicturesThereAre) {
  const std::string out = folder_ / "made/pictures";
  const CommandRun run =
      Camera({"look", "--lease", "abc", "--camera", "left", "--width-px", "320", "--out", out, "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(cameras_.lease, "abc");
  EXPECT_EQ(ReadBytes(out + "/left.jpg"), "a jpeg");
  EXPECT_FALSE(std::filesystem::exists(out + "/right.jpg"));
  EXPECT_THAT(cameras_.asked, HasSubstr("camera_id: \"left\" width_px: 320"));
  EXPECT_THAT(run.out, HasSubstr("\"id\": \"left\""));
  EXPECT_THAT(run.out, HasSubstr("\"problem\": \"it does not answer\""));
  EXPECT_THAT(run.out, HasSubstr("\"jpeg\": \"\""));
}

TEST_F(CommandCamera, LooksAtTheCamerasOfASession) {
  WriteBytes(folder_ / "session.json",
             R"({"cameras": [{"id": "c01", "gige": {"device": "10.0.0.7"}}], "fps": 10})");
  ASSERT_TRUE(Camera({"look", "--session", folder_ / "session.json"}).status.ok());
  EXPECT_THAT(cameras_.asked, HasSubstr("cameras { cameras { id: \"c01\" gige { device: \"10.0.0.7\""));
  // A take goes before a session, and that before a lease.
  ASSERT_TRUE(Camera({"look", "--session", folder_ / "session.json", "--take", "walk", "--lease", "abc"})
                  .status.ok());
  EXPECT_EQ(cameras_.asked, "take_id: \"walk\" width_px: 640");
  ASSERT_TRUE(Camera({"look", "--session", folder_ / "session.json", "--lease", "abc"}).status.ok());
  EXPECT_THAT(cameras_.asked, HasSubstr("cameras { "));
}

TEST_F(CommandCamera, SomethingMustBeLookedAt) {
  unsetenv("WEFT_LEASE");
  const CommandRun run = Camera({"look"});
  EXPECT_EQ(run.status, absl::InvalidArgumentError(
                            "give --session FILE, --take ID, or the --lease of a session (or WEFT_LEASE)"));
  EXPECT_EQ(cameras_.asked, "");
}

}  // namespace
}  // namespace weft
