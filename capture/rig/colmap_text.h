// Rigs as COLMAP's text model: cameras.txt and images.txt. COLMAP puts (0, 0) at the corner of the top-left
// pixel, so principal points differ by half a pixel from ours; lengths stay mm.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "capture/rig/foreign_rig.h"

namespace weft {

struct ColmapText {
  std::string cameras;  // cameras.txt
  std::string images;   // images.txt
};

// Cameras of the models SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV. FOV and the
// fisheye models without tangential terms are fitted (FitLens). Each image is a camera of the rig. It is
// named as its file without ending, or as the nearest folder of which each has one of its own, or which is
// above a number where there is one image: cam1/images/0001.png. cam<camera>/image... is <camera>. The line
// of points after an image may be missing. InvalidArgument names file, line and what was expected there.
absl::StatusOr<ForeignRig> ParseColmapText(std::string_view cameras, std::string_view images,
                                           const std::string& source_name);

// FULL_OPENCV cameras, an image <id>.png each. Every digit is kept; rotations go through a quaternion.
absl::StatusOr<ColmapText> FormatColmapText(const Rig& rig);

}  // namespace weft
