// Cloth that is made to fold: a pleated skirt, a gathered one, a sheet whose hems curl. How each is put
// together, how it is held and what it hangs around; the solver makes the folds.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "figure/capsule.h"
#include "physics/fabric.h"
#include "simulation/cloth.h"
#include "simulation/performance.h"

namespace weft {

// A limb or the trunk, in the axes of what holds the cloth; it swings around a line along x.
struct SwingingCapsule {
  Capsule capsule;
  Eigen::Vector3d pivot_mm = Eigen::Vector3d::Zero();
  double swing_rad = 0;  // each way
};

struct FoldedCloth {
  Cloth cloth;
  std::vector<Eigen::Vector3d> start_mm;  // [vertices], free of self-intersections
  std::vector<Crease> creases;
  // Vertices that are held, and where: from their start to where they stay. In the axes of what holds them,
  // the world's but for its motion.
  std::vector<int> held;
  std::vector<Eigen::Vector3d> held_from_mm, held_to_mm;
  std::vector<SwingingCapsule> body;
};

// Pressed pleats of uneven width that lean to one side: between two folds 5 to 8 cells go around the body and
// 3 or 4 return below the next fold. The upper border is sewn down as pleated.
absl::StatusOr<FoldedCloth> MakePleatedSkirt(const PerformanceOptions& options);

// A tube whose upper border is drawn together to 1 - `handles.compression` of its length, on two threads
// with stitches every 4 to 9 cells. Between the stitches it buckles freely.
absl::StatusOr<FoldedCloth> MakeGatheredSkirt(const PerformanceOptions& options);

// A sheet on hooks, cut into strips 8 to 13 cells wide below its upper border. Lower hems roll towards the
// printed side, side hems away from it, as jersey does; how tight differs from place to place.
absl::StatusOr<FoldedCloth> MakeCurlingSheet(const PerformanceOptions& options);

}  // namespace weft
