// Regions of a self-intersecting patch that lie on the wrong side. Global intersection analysis after
// Baraff, Witkin and Kass 2003 (Untangling Cloth), with the loop vertices of Ye et al. 2017.
#pragma once

#include <vector>

#include "alignment/untangle/untangle_patch.h"

namespace weft {

// An edge that passes through a face with which it shares no vertex.
struct Piercing {
  int edge = 0, face = 0;
  double at = 0;  // on the edge, as a share of the way from a to b

  Eigen::Vector3d PointOn(const UntanglePatch& patch) const {
    const PatchEdge& e = patch.edges[edge];
    return (1 - at) * patch.position_mm[e.a] + at * patch.position_mm[e.b];
  }
};

// Ordered by edge, then face. Only those where a free vertex takes part.
std::vector<Piercing> FindPiercings(const UntanglePatch& patch);

// Vertices that the piercings separate from the rest of the patch. They lie on the wrong side of another
// layer or, as a loop, form a fold whose sides intersect.
struct CutOffRegion {
  std::vector<int> vertices;  // ordered
  std::vector<int> opposite;  // faces that its edges pierce where it ends, ordered
  bool loop = false;
};

struct CutOffRegions {
  std::vector<CutOffRegion> regions;
  std::vector<bool> explained;  // [piercings], whether one of the regions takes part
};

CutOffRegions FindRegions(const UntanglePatch& patch, const std::vector<Piercing>& piercings);

}  // namespace weft
