// Rigs as COLMAP's text model: cameras.txt and images.txt. COLMAP puts (0, 0) at the corner of the top-left
// pixel, so principal points differ by half a pixel from ours; lengths stay mm.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

struct ColmapText {
  std::string cameras;  // cameras.txt
  std::string images;   // images.txt
};

// Cameras of the models SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV; each image is
// a camera of the rig, named as its file without ending. InvalidArgument names file, line and what was
// expected there.
absl::StatusOr<Rig> ParseColmapText(std::string_view cameras, std::string_view images,
                                    const std::string& source_name);

// FULL_OPENCV cameras, an image <id>.png each. Every digit is kept; rotations go through a quaternion.
absl::StatusOr<ColmapText> FormatColmapText(const Rig& rig);

}  // namespace weft
