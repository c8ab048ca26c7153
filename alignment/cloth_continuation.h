// Where cloth that was not measured goes on beside cloth that was.
#pragma once

#include <vector>

#include "alignment/align.h"

namespace weft {

// A place that a vertex without a target has if the measured cloth beside it goes on as it bends there.
struct ContinuedVertex {
  int vertex = -1;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;  // per axis, of the guess
};

// Faces between three targets know their rotation from rest, and how it changes from face to face: the
// curvature, in the axes of the rest shape. Faces beyond carry it on, ring after ring, as an arc goes on;
// each vertex is the mean of where the faces around it have it. Only vertices near the template's border are
// continued, and none between measured cloth on several sides: there the smooth fill knows better. Targets of
// unknown sigma have `reference_sigma_mm`. Ordered by vertex.
std::vector<ContinuedVertex> ContinueCloth(const AlignmentModel& model,
                                           const std::vector<VertexTarget>& targets,
                                           const ContinuationOptions& options, double reference_sigma_mm);

}  // namespace weft
