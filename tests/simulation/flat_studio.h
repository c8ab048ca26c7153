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

// Even light of 1 on plain inks, before a black room.
inline StudioOptions PlainLook() {
  StudioOptions look;
  look.inks.cell_variation = 0;
  look.fabric.weave_variation = look.fabric.knit_depth = look.fabric.wrinkle_slope = look.fabric.fuzz = 0;
  look.room.wall.setZero();
  look.room.strut = look.room.lamp_glow = 0;
  look.room.floor_below_mm = 1e6;
  look.light.lamps.clear();
  look.light.dome_radiance = 1, look.light.dome_gradient = 0;
  return look;
}

// Moving at `velocity_mm_s`.
inline StudioScene SceneOf(const Cloth& cloth, const StudioOptions& look,
                           const Eigen::Vector3d& velocity_mm_s = Eigen::Vector3d::Zero()) {
  absl::StatusOr<Board> board =
      GenerateBoard(cloth.options.rows, cloth.options.cols, cloth.options.cell_mm, 1);
  EXPECT_TRUE(board.ok()) << board.status();
  MovingMesh sheet{cloth.rest, {}};
  if (!velocity_mm_s.isZero()) sheet.velocities_mm_s.assign(cloth.rest.vertices_mm.size(), velocity_mm_s);
  absl::StatusOr<StudioScene> scene =
      StudioScene::Build(std::move(sheet), cloth.print, *std::move(board), {}, look);
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
