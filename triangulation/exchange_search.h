// Which cameras of a rig were exchanged, where too few are right for any point to say it.
#pragma once

#include <vector>

#include "triangulation/triangulate.h"

namespace weft {

struct SearchedCamera {
  int place = 0;    // whose model its observations are to be read with
  int nodes = 0;    // looked at, seen by three or more cameras
  int meeting = 0;  // of them, those at which its ray meets two others; 0 of a camera that was exchanged
};

struct ExchangeSearch {
  bool found = false;                     // exchanges that make the rays meet, no others as well
  std::vector<SearchedCamera> of_camera;  // [cameras of the rig]; as given where nothing was found
};

// Exchanges the models of two cameras, the pair that lets most rays meet, again and again while that helps: a
// ring of three is two exchanges. Looks at 150 nodes. Empty `of_camera` for rigs of more than 40 cameras.
// `views` are of cameras of the rig, options valid.
ExchangeSearch SearchExchanges(const Rig& rig, const std::vector<ViewObservations>& views,
                               const TriangulationOptions& options);

}  // namespace weft
