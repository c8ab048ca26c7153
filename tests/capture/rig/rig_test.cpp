#include "capture/rig/rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

using ::testing::HasSubstr;

CameraModel SomeCamera(const std::string& id) {
  CameraModel camera;
  camera.id = id;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 500;
  camera.cx_px = 300;
  camera.cy_px = 250;
  return camera;
}

TEST(Rig, AcceptsDistinctValidCameras) {
  EXPECT_TRUE((Rig{"r", {SomeCamera("a"), SomeCamera("b")}}).Validate().ok());
}

TEST(Rig, NamesCameraAndFieldOfWhatIsWrong) {
  const auto message_after = [](auto change) {
    Rig rig{"r", {SomeCamera("400038")}};
    change(rig.cameras[0]);
    const absl::Status status = rig.Validate();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  using Camera = CameraModel&;
  EXPECT_THAT(message_after([](Camera c) { c.width_px = 0; }), HasSubstr("camera 400038: width_px"));
  EXPECT_THAT(message_after([](Camera c) { c.height_px = 70000; }), HasSubstr("height_px"));
  EXPECT_THAT(message_after([](Camera c) { c.fx_px = -1; }), HasSubstr("fx_px"));
  EXPECT_THAT(message_after([](Camera c) { c.fy_px = NAN; }), HasSubstr("fy_px"));
  EXPECT_THAT(message_after([](Camera c) { c.cx_px = INFINITY; }), HasSubstr("cx_px"));
  EXPECT_THAT(message_after([](Camera c) { c.distortion[3] = NAN; }), HasSubstr("distortion"));
  EXPECT_THAT(message_after([](Camera c) { c.translation_mm.x() = NAN; }), HasSubstr("translation_mm"));
  EXPECT_THAT(message_after([](Camera c) { c.rotation(0, 0) = -1; }), HasSubstr("rotation"));
  EXPECT_THAT(message_after([](Camera c) { c.rotation *= 1.01; }), HasSubstr("rotation"));
}

TEST(Rig, RejectsDoubleAndMissingCameras) {
  EXPECT_THAT(std::string((Rig{"r", {SomeCamera("a"), SomeCamera("a")}}).Validate().message()),
              HasSubstr("twice"));
  EXPECT_FALSE(Rig{}.Validate().ok());
}

TEST(Rig, HashChangesWithEveryNumber) {
  const Rig rig{"r", {SomeCamera("a"), SomeCamera("b")}};
  EXPECT_EQ(rig.ContentHash().size(), 16u);
  EXPECT_EQ(rig.ContentHash(), Rig(rig).ContentHash());
  Rig other = rig;
  other.cameras[1].cy_px += 1e-9;
  EXPECT_NE(rig.ContentHash(), other.ContentHash());
  other = rig;
  other.cameras[0].distortion[7] = 1e-12;
  EXPECT_NE(rig.ContentHash(), other.ContentHash());
  other = rig;
  std::swap(other.cameras[0], other.cameras[1]);
  EXPECT_NE(rig.ContentHash(), other.ContentHash());
}

}  // namespace
}  // namespace weft
