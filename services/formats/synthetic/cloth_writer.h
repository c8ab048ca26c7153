// A synthetic take without pictures: the true cloth of every frame, in a thousandth of the time.
#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "services/formats/synthetic/take_folder.h"
#include "simulation/synthetic_take.h"

namespace weft {

struct ClothSummary {
  int frames = 0;
  int vertices = 0;
  int resumed_at = 0;           // frames that stood there already
  int intersecting_frames = 0;  // of those written now, whose cloth passes through itself
  uint64_t bytes_per_frame = 0;
};

// By what share edges are longer or shorter than at rest, in the median over faces' edges: below .02 for worn
// cloth; beyond kTornStretch the simulation has broken down. Positions in mm, [vertices].
double MedianStretch(const TriangleMesh& rest, const std::vector<Eigen::Vector3d>& vertices_mm);
inline constexpr double kTornStretch = 0.1;

// Writes rig, board and template as WriteSyntheticTake does, and truth/frames.bin. A take that was begun goes
// on where it was stopped, the cloth's motion included; once a minute it is saved for that. `on_dress` (may
// be empty) is called with the share done before the first frame, `on_frame` with the number of finished
// frames. Cancelled, with all finished frames kept, when `stop` is requested. The same bytes at any thread
// count, in one go or in several. Internal names the frame in which the simulation broke down; it and later
// ones are not written. Errors of SyntheticTake and of files.
absl::StatusOr<ClothSummary> WriteClothTake(const SyntheticTakeOptions& options, const TakeFolder& folder,
                                            const std::function<void(double)>& on_dress = {},
                                            const std::function<void(int)>& on_frame = {},
                                            const std::stop_token& stop = {});

}  // namespace weft
