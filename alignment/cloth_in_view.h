// How much of a registered mesh a camera should see, and how much of it it saw.
#pragma once

#include <vector>

#include "alignment/mesh.h"
#include "alignment/template.h"
#include "capture/rig/rig.h"
#include "triangulation/triangulate.h"

namespace weft {

struct ClothInView {
  int vertices = 0;  // that face the camera in its image, of those that were looked at
  int seen = 0;      // of them, observed within kSeenPx of where the mesh has them
};

// A camera that was knocked sees its cells so far off; those of images that are not its own are anywhere.
inline constexpr double kSeenPx = 20;

// For each view, from about 3,000 of the vertices with a cell that two or more cameras measured. In view are
// those in the image that the camera sees by less than 60 degrees from their normal, with cells of 4 px or
// more; cloth that lies before them is not looked at. Empty where mesh and template differ in their vertices.
std::vector<ClothInView> CountClothInView(const Rig& rig, const std::vector<ViewObservations>& views,
                                          const Template& garment, const RegisteredMesh& mesh);

}  // namespace weft
