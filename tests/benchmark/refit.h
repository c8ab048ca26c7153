// Fits tuned constants of the decoder anew to takes of `weft simulate`, and prints them as they stand in the
// code.
#pragma once

#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "pattern/view_decoder.h"
#include "tests/benchmark/decode_score.h"

namespace weft::testing {

// Folders that `weft simulate` wrote.
struct RefitTakes {
  std::vector<std::string> fitted;
  std::vector<std::string> held_out;  // only measured
};

// Calls visit(view, decoder), before anything is decoded, for the views of a take. Errors of the folder or of
// a view.
absl::Status ForEachView(const std::string& folder,
                         absl::FunctionRef<void(const NodesOfView&, ViewDecoder&)> visit);

// Weights of the evidence for a cell (pattern/surface/confidence.cpp), from all cells before the unsure ones
// are evicted. `ridge` as for FitLogistic. A cell on a crest (Verdict::kOnCrest) is wrong, and counts
// `crest_counts` (above 0) as much as others.
absl::Status RefitConfidence(const RefitTakes& takes, double ridge, double crest_counts);
// Ratio between errors and CellFit::sigma_px (pattern/fit/cell_fitter.h).
absl::Status RefitSigma(const RefitTakes& takes);
// What further steps of a fit still add to the explained share (pattern/fit/cell_fitter.cpp).
absl::Status RefitRejection(const RefitTakes& takes);
// What the decoder makes of a view, without a picture (simulation/observation_model.cpp).
absl::Status RefitObservation(const RefitTakes& takes);

}  // namespace weft::testing
