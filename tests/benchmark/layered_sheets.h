// Cloth in layers, as photographs of worn garments show it: what a folded view of one sheet lacks.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/rig/camera_model.h"
#include "pattern/board/board.h"
#include "simulation/studio_scene.h"
#include "simulation/view_truth.h"

namespace weft::testing {

// A folded sheet whose sides turn away from the camera, with flaps and fingers in front of it. All are sewn
// from panels that lie anywhere on one board, at any angle: beyond a seam, an edge or a silhouette, other
// print goes on. The same seed gives the same scene.
struct LayeredScene {
  Board board;
  StudioScene scene;
};
absl::StatusOr<LayeredScene> MakeLayers(uint64_t seed);

// A picture of the scene with truth. Pitch, blur, light and noise are drawn anew for each view. Two of three
// pictures show a small part, are saved as JPEG and enlarged by a factor of 1.4 to 3.1 (as publishers do), so
// blur and noise are as wide as cells.
struct LayeredView {
  CameraModel camera;  // of the picture as it is returned
  Frame image;
  ViewTruth truth;
};
absl::StatusOr<LayeredView> FilmLayers(const LayeredScene& scene, uint64_t seed, int view);

}  // namespace weft::testing
