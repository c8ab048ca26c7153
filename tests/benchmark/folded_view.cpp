#include "tests/benchmark/folded_view.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "simulation/cloth.h"
#include "simulation/renderer.h"
#include "simulation/studio_scene.h"

namespace weft::testing {
namespace {

constexpr int kRows = 210, kCols = 400;
constexpr double kCellMm = 2.7, kWidthMm = kCols * kCellMm, kHeightMm = kRows * kCellMm;

// Direction of the cloth seen from above, at s mm along a row and y mm from the top. It goes around a body by
// 150 degrees, in folds that are deeper further down, lean, and are no two alike.
double DirectionAt(double s_mm, double y_mm) {
  const double depth = 0.9 + 0.6 * y_mm / kHeightMm;
  const double folds = s_mm / 60 + 0.3 * std::sin(2 * M_PI * s_mm / 230) + 0.12 * std::sin(y_mm / 90);
  return 2.6 * (s_mm / kWidthMm - 0.5) + depth * std::sin(2 * M_PI * folds);
}

// Lengths along rows are those of the flat cloth.
std::vector<Eigen::Vector3d> Folded(const Cloth& cloth) {
  std::vector<Eigen::Vector3d> bent = cloth.rest.vertices_mm;
  constexpr int kSteps = 8;  // of the integral, per vertex
  for (int i = 0; i < cloth.grid_rows; ++i) {
    const double y_mm = kCellMm * cloth.row_position[i];
    Eigen::Vector3d at(0, y_mm - 0.5 * kHeightMm, 0);
    double s_mm = 0;
    for (int j = 0; j < cloth.grid_cols; ++j) {
      const double step_mm = (kCellMm * cloth.col_position[j] - s_mm) / kSteps;
      for (int k = 0; k < kSteps; ++k) {
        const double direction = DirectionAt(s_mm + 0.5 * step_mm, y_mm);
        at += step_mm * Eigen::Vector3d(std::cos(direction), 0, std::sin(direction));
        s_mm += step_mm;
      }
      bent[cloth.vertex_at(i, j)] = at;
    }
    const double width_mm = at.x();
    for (int j = 0; j < cloth.grid_cols; ++j) bent[cloth.vertex_at(i, j)].x() -= 0.5 * width_mm;
  }
  return bent;
}

// From above and the side, so that folds hide what is behind them.
CameraModel CameraFromAbove() {
  CameraModel camera;
  camera.id = "above";
  camera.width_px = 1240, camera.height_px = 1130;
  camera.fx_px = camera.fy_px = 1700;
  camera.cx_px = 0.5 * camera.width_px, camera.cy_px = 0.5 * camera.height_px;
  camera.rotation =
      (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  camera.translation_mm = {0, 0, 830};
  return camera;
}

}  // namespace

TrueTake MakeFoldedView() {
  const Cloth cloth =
      *BuildCloth({.shape = ClothShape::kSheet, .rows = kRows, .cols = kCols, .cell_mm = kCellMm});
  TrueTake take{"folded view", *GenerateBoard(kRows, kCols, kCellMm, 7), {}};
  StudioOptions look;
  look.light.rays = 48;
  const StudioScene scene =
      *StudioScene::Build({{Folded(cloth), cloth.rest.faces}, {}}, cloth.print, take.board, {}, look);
  CameraOptions options;
  options.lens.point_spread_sigma_px = 1;
  options.sensor.readout = Readout::kColor;
  const CameraModel camera = CameraFromAbove();
  Frame image = ToFrame(*RenderView(scene, camera, options, 0));
  ViewTruth truth = FindViewTruth(scene.mesh(), PrintLocator(cloth.print), scene.rays(), camera);
  take.views.push_back({"0000", std::move(image), std::move(truth)});
  return take;
}

}  // namespace weft::testing
