// How far cloth is stretched, place by place.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/align.h"

namespace weft {

// A mesh at rest whose edges are as long as the measured cloth around them. Each vertex gets the symmetric
// matrix that best maps its rest edges to those between targets, rotated back. The matrices are smoothed
// over `rings` rings and interpolated where nothing was measured. An edge takes the mean of its ends.
// rotation: [vertices], of a registration to these targets. Components without targets keep their edges.
absl::StatusOr<SlicedMesh> StretchToTargets(const AlignmentModel& model,
                                            const std::vector<VertexTarget>& targets,
                                            const std::vector<Eigen::Matrix3d>& rotation, int rings);

}  // namespace weft
