// Scores decodings of synthetic views against what is true of them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "pattern/decoder.h"
#include "simulation/view_truth.h"

namespace weft::testing {

struct TrueView {
  std::string frame;
  Frame image;
  ViewTruth truth;
};

struct TrueTake {
  std::string name;
  Board board;
  std::vector<TrueView> views;
};

// Views of the first and the middle frame of a folder that `weft simulate` wrote.
absl::StatusOr<TrueTake> ReadTrueTake(const std::string& folder);
// A tube with folds, filmed here: one frame, every fourth camera.
TrueTake MakeSmallTake();

// An observation with what is true of it.
struct ScoredObservation {
  BoardNode node;
  bool right = false;  // the node is there, within half a pitch
  double error_px = 0, pitch_px = 0;
  float sigma_px = 0, confidence = 0;
  int neighbors = 0;    // of the 8 around it, observed
  // Least standard deviations per axis of any unbiased estimate (center_bound.h); 0 where not worked out.
  double bound_px = 0, residual_bound_px = 0;
};

// A cell that is expected to be found.
struct ScoredCell {
  double pitch_px = 0;
  bool found = false;  // observed where it is
};

struct DecodeScore {
  std::vector<ScoredObservation> observations;
  std::vector<ScoredCell> cells;
  double user_s = 0;
  size_t views = 0;

  // Cells of at least `least_px` and less than `most_px`, and the share of them that is found.
  size_t CellsOf(double least_px, double most_px) const;
  double Recall(double least_px = 0, double most_px = 1e9) const;
  // Observed cells that are not where they were observed, and the share of those that are.
  size_t WrongCells() const;
  double Precision() const;
  // Errors of right observations.
  std::vector<double> ErrorsPx(NodeKind kind) const;
};

// Adds a decoding of a view.
void Score(const DecodeResult& result, const ViewTruth& truth, DecodeScore* score);

// Decodes all views in the calling thread; `on_view` (may be empty) is called with the views done.
absl::StatusOr<DecodeScore> DecodeAndScore(const TrueTake& take, const BoardIndex& index,
                                           const DecodeOptions& options,
                                           const std::function<void(size_t)>& on_view = {});

// User time of the calling thread.
double UserSeconds();

// The value that this share of the values does not exceed; 0 of none.
double Quantile(std::vector<double> values, double share);

}  // namespace weft::testing
