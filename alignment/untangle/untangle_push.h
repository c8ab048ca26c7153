// Moves that take a patch out of its piercings. They may pass through anything on their way.
#pragma once

#include <vector>

#include "alignment/untangle/cut_off_regions.h"
#include "alignment/untangle/untangle_patch.h"

namespace weft {

// Displacements asked of free vertices, averaged by weight.
class PushField {
 public:
  explicit PushField(const UntanglePatch& patch);

  // Asks that the point with these weights of the corners moves by `move` against the point with those
  // weights, the lighter side giving way more.
  struct Corner {
    int vertex = 0;
    double share = 0;  // negative on the side that moves the other way
  };
  void Part(const std::vector<Corner>& corners, const Eigen::Vector3d& move);

  // Moves the patch: the vertices asked as they were asked, the others along with them, less and less with
  // the distance, and bounded ones no further than they may.
  void Apply(UntanglePatch* patch) const;

 private:
  const UntanglePatch& patch_;
  std::vector<Eigen::Vector3d> sum_;  // [free]
  std::vector<double> weight_;        // [free]
};

// The region goes back through the layer opposite, half the way each (Baraff et al. 2003), and further by
// gap_mm.
void PushRegion(const UntanglePatch& patch, const CutOffRegion& region, double gap_mm, PushField* field);

// Shortens the contour that the piercing belongs to (Volino and Magnenat-Thalmann 2006, Resolving Surface
// Collisions through Intersection Contour Minimization, Eq. 5), by step_mm at the most.
void ShortenContour(const UntanglePatch& patch, const Piercing& piercing, double step_mm, PushField* field);

// The vertices (free ones only) and all within some rings of them, ordered.
std::vector<int> GrownInPatch(const UntanglePatch& patch, const std::vector<int>& vertices, int rings);

// Lays the vertices, and those within some rings of them, between their surroundings like a soap film;
// bounded ones stay where they are. A sheet of which nothing would remain around them is left as it is.
void Flatten(const std::vector<int>& vertices, int rings, UntanglePatch* patch);

}  // namespace weft
