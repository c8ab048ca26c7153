// A small result with the cameras and the pictures that it could have come from.
#pragma once

#include <array>
#include <memory>

#include "capture/image/frame.h"
#include "capture/image/image_file.h"
#include "capture/rig/rig.h"
#include "services/formats/files/rig_file.h"
#include "tests/services/results/export/small_result.h"

namespace weft {

// Cameras c1 and c2 look down from 1000 mm upon the middle of the square, whose faces are turned to them.
// Each picture has one colour.
struct FilmedResult : SmallResult {
  static constexpr int kWidth_px = 160, kHeight_px = 100;
  static constexpr std::array<uint8_t, 3> kColor = {100, 150, 50};

  FilmedResult() {
    for (const char* id : {"c1", "c2"}) {
      CameraModel& camera = rig.cameras.emplace_back();
      camera.id = id;
      camera.width_px = kWidth_px;
      camera.height_px = kHeight_px;
      camera.fx_px = camera.fy_px = 1000;
      camera.cx_px = kWidth_px / 2;
      camera.cy_px = kHeight_px / 2;
      camera.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
      camera.translation_mm = {-50, 25, 1000};
      for (int frame = 0; frame < kFrames; ++frame) {
        std::filesystem::create_directories(folder / absl::StrFormat("dump/%04d", frame));
        EXPECT_TRUE(WriteImageFile(Picture(frame, id), PictureOf()).ok());
      }
    }
    EXPECT_TRUE(WriteRig(recording.rig, rig).ok());
  }

  static Frame PictureOf() {
    auto pixels = std::make_shared<std::vector<uint8_t>>();
    for (int i = 0; i < kWidth_px * kHeight_px; ++i)
      pixels->insert(pixels->end(), kColor.begin(), kColor.end());
    Frame frame;
    frame.width_px = kWidth_px;
    frame.height_px = kHeight_px;
    frame.format = PixelFormat::kRgb8;
    frame.pixels = std::move(pixels);
    return frame;
  }
  std::string Picture(int frame, const std::string& camera) const {
    return folder / absl::StrFormat("dump/%04d/%s.png", frame, camera);
  }

  Rig rig;
  RecordingChoice recording{.dump = folder / "dump", .rig = folder / "rig.json", .cameras = {}};
};

}  // namespace weft
