// The second look: what the first registration of a frame did not observe is looked for where it must be.
#pragma once

#include <stop_token>
#include <vector>

#include "absl/status/status.h"
#include "alignment/cell_prediction.h"
#include "services/pipeline/registration_inputs.h"
#include "triangulation/triangulate.h"
#include "weft/v1/report.pb.h"

namespace weft {

struct SecondLookOptions {
  // Cells that so many cameras measured are not looked for again.
  int enough_views = 3;
  PredictionOptions prediction;
  GuidedOptions guided;
};

// Predicts from the first mesh where the cells of vertices with too few views lie in the cameras that did not
// decode them, reads those views again, and adds to `views` (one per camera of the rig, in its order) what is
// found there; every find is to be confirmed by triangulation with the other cameras. `reports` [cameras]
// receive the counts. Views whose image is gone stay as they are. Returns the number of observed centres that
// were added. Runs in the calling thread's TBB arena; the same result at any thread count.
absl::StatusOr<int> LookAgain(const RegistrationInputs& inputs, size_t index, const RegisteredMesh& mesh,
                              const SecondLookOptions& options, const std::stop_token& stop,
                              std::vector<ViewObservations>* views, std::vector<v1::ViewReport*> reports);

}  // namespace weft
