// A flat sheet before one camera, where everything can be computed by hand.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <utility>

#include "simulation/cloth.h"
#include "simulation/studio_scene.h"

namespace weft {

inline constexpr double kFlatCellMm = 4;

inline Cloth FlatSheet(int rows, int cols) {
  ClothOptions options;
  options.shape = ClothShape::kSheet;
  options.rows = rows, options.cols = cols, options.cell_mm = kFlatCellMm;
  absl::StatusOr<Cloth> cloth = BuildCloth(options);
  EXPECT_TRUE(cloth.ok()) << cloth.status();
  return *std::move(cloth);
}

// Even light of 1 on plain inks.
inline StudioOptions PlainLook() {
  StudioOptions look;
  look.inks.cell_variation = look.inks.weave_variation = 0;
  look.light.lamps.clear();
  look.light.dome_radiance = 1, look.light.dome_gradient = 0;
  return look;
}

inline StudioScene SceneOf(const Cloth& cloth, const StudioOptions& look) {
  absl::StatusOr<Board> board =
      GenerateBoard(cloth.options.rows, cloth.options.cols, cloth.options.cell_mm, 1);
  EXPECT_TRUE(board.ok()) << board.status();
  absl::StatusOr<StudioScene> scene = StudioScene::Build(cloth.rest, cloth.print, *std::move(board), look);
  EXPECT_TRUE(scene.ok()) << scene.status();
  return *std::move(scene);
}

// Looks at the origin from `distance_mm` away, turned by `angle_deg` around the y axis: at 0 it stands at
// (0, 0, -distance) and looks along +z.
inline CameraModel FlatCamera(double focal_px, double distance_mm, double angle_deg) {
  CameraModel camera;
  camera.id = "flat";
  camera.width_px = 320, camera.height_px = 240;
  camera.fx_px = focal_px, camera.fy_px = focal_px;
  camera.cx_px = 157.3, camera.cy_px = 121.8;
  camera.rotation =
      Eigen::AngleAxisd(angle_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
  camera.translation_mm = {0, 0, distance_mm};
  return camera;
}

}  // namespace weft
