// Cameras as the checks of verdicts judge them.
#pragma once

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/formats/verdict/camera_checks.h"

namespace weft {

// Cameras c00, c01, ... that agree.
inline std::vector<CameraStanding> Agreeing(int count) {
  std::vector<CameraStanding> cameras;
  for (int c = 0; c < count; ++c)
    cameras.push_back({.camera = absl::StrCat(c < 10 ? "c0" : "c", c),
                       .compared = 1000,
                       .agreeing = 998,
                       .median_px = 0.2,
                       .frames = 2,
                       .scale = 1,
                       .scale_sigma = 1e-4,
                       .perspective_sigma = 0.004});
  return cameras;
}

inline void SetApart(CameraStanding& camera, const std::string& fits = "", const std::string& turned = "") {
  camera.agreeing = 20, camera.median_px = 214, camera.frames_apart = 2;
  camera.fits_camera = fits, camera.fits_turned = turned, camera.fits_px = fits.empty() ? 0 : 0.2;
  camera.scale = camera.scale_sigma = 0;
}

}  // namespace weft
