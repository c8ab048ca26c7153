// The second pass: what the first registration of a frame did not observe is looked for where it must be.
#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "absl/status/status.h"
#include "alignment/cell_prediction.h"
#include "pattern/view_decoder.h"
#include "services/formats/options/pipeline_options.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "services/work/pipeline/registration_inputs.h"
#include "triangulation/triangulate.h"
#include "weft/v1/report.pb.h"

namespace weft {

// A frame as far as it is registered, and how to look again.
struct SecondPassInputs {
  const RegistrationInputs& inputs;
  size_t frame;  // index in the dump
  const RegisteredMesh& mesh;
  const SecondPassOptions& options;
};

struct SecondPassResult {
  bool changed = false;    // whether any view has other observations now
  double added_share = 0;  // of the centres that there are now
};

// Predicts from the mesh the cells of vertices with too few views, in the cameras that did not
// decode them. Their `decoders`, at rest before and after, search there, with the image of the first pass,
// or read again where it was dropped. `views` receive all observations that the decoders have then. Every
// find has to be confirmed by triangulation with the other cameras. The report's views receive the counts.
// Decoders, views and the report's views have an entry per camera of the rig, in its order. Views without a
// decoder, or whose image is gone, stay as they are. Runs in the calling thread's TBB arena; the same result
// at any thread count.
absl::StatusOr<SecondPassResult> SecondPass(Computes<Stage::kSecondPass>, const SecondPassInputs& pass,
                                            const std::stop_token& stop,
                                            const std::vector<std::unique_ptr<ViewDecoder>>& decoders,
                                            std::vector<ViewObservations>* views, v1::FrameReport& report);

}  // namespace weft
