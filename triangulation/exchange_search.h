// Which cameras of a rig were exchanged, where too few are right for any point to say it.
#pragma once

#include <vector>

#include "capture/rig/exchange_cameras.h"
#include "triangulation/triangulate.h"

namespace weft {

struct SearchedCamera {
  int place = 0;    // the camera whose part it has
  int nodes = 0;    // looked at, seen by three or more cameras
  int meeting = 0;  // of them, those at which its ray meets two others; 0 of a camera that was exchanged
};

struct ExchangeSearch {
  bool found = false;                           // exchanges that make the rays meet, no others as well
  CameraPart part = CameraPart::kPlaceAndLens;  // of the others, that the cameras have
  std::vector<SearchedCamera> of_camera;        // [cameras of the rig]; as given where nothing was found
};

// Exchanges two cameras, the pair that lets most rays meet, again and again while that helps: a ring of three
// is two exchanges. First place and lens, then, where that does not help, places alone. Looks at 150 nodes.
// Empty `of_camera` for rigs of more than 40 cameras. `views` are of cameras of the rig, options valid.
ExchangeSearch SearchExchanges(const Rig& rig, const std::vector<ViewObservations>& views,
                               const TriangulationOptions& options);

}  // namespace weft
