// Rigs that go to another program's format and come back, and the YAML of one camera.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/foreign_rig.h"

namespace weft {

inline Rig TwoCameras(bool rational) {
  Rig rig;
  for (int i = 0; i < 2; ++i) {
    CameraModel camera;
    camera.id = i == 0 ? "400002" : "left";
    camera.width_px = 2668;
    camera.height_px = 4096;
    camera.fx_px = 4000.1 / 3 + i;
    camera.fy_px = 4001.7 / 3;
    camera.cx_px = 1185.25 + 1e-9;
    camera.cy_px = 2049.0 / 7;
    camera.distortion = {-0.1, 0.2 / 3, 1e-3, -2e-3 / 7, 0.05, 0, 0, 0};
    if (rational) camera.distortion[5] = 0.01, camera.distortion[7] = -0.002;
    camera.rotation = Eigen::AngleAxisd(0.7 + i, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    camera.translation_mm = {10.0 / 3, -20, 3000.123456789};
    rig.cameras.push_back(camera);
  }
  return rig;
}

inline void ExpectSame(const Rig& a, const Rig& b) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (size_t i = 0; i < a.cameras.size(); ++i) {
    const CameraModel &x = a.cameras[i], &y = b.cameras[i];
    EXPECT_EQ(x.id, y.id);
    EXPECT_EQ(x.width_px, y.width_px);
    EXPECT_EQ(x.height_px, y.height_px);
    for (int k = 0; k < 8; ++k) EXPECT_EQ(x.distortion[k], y.distortion[k]);
    EXPECT_LT((x.rotation - y.rotation).norm(), 1e-14);
    for (const Eigen::Vector3d& point : {Eigen::Vector3d(3, 50, 90), Eigen::Vector3d(-80, 20, -40)}) {
      EXPECT_LT((x.Project(point).value() - y.Project(point).value()).norm(), 1e-9);
    }
  }
}

inline std::vector<std::string> IdsOf(const absl::StatusOr<ForeignRig>& rig) {
  EXPECT_TRUE(rig.ok()) << rig.status();
  std::vector<std::string> ids;
  if (rig.ok())
    for (const CameraModel& camera : rig->rig.cameras) ids.push_back(camera.id);
  return ids;
}

inline std::string YamlMatrix(const std::string& name, int rows, int cols, const std::string& data) {
  return name + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(cols) + "\n  data: [" +
         data + "]\n";
}

inline std::string YamlCamera(const std::string& rest) {
  return "image_width: 1280\nimage_height: 1024\n" +
         YamlMatrix("camera_matrix", 3, 3, "700., 0., 640., 0., 700., 512., 0., 0., 1.") + rest;
}

// Without distortion.
inline std::string PosedCamera(const std::string& rest) {
  return YamlCamera(YamlMatrix("distortion_coefficients", 5, 1, "0, 0, 0, 0, 0") + rest);
}

}  // namespace weft
