// Scores decodings of synthetic views against what is true of them.
#pragma once

#include <functional>
#include <map>
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

// Whether a node is where it was observed.
enum class Verdict {
  kRight,  // within half a pitch
  // Not so, but within half the pitch of a node beside it: a cell on the crest of a fold, both sides of which
  // are seen edge-on in part, projects to hardly any area.
  kOnCrest,
  kWrong,
  // Not known, as it may be beyond the border of the picture, less than a pixel away.
  kUnjudged,
};

// The truth of a view, by node.
class NodesOfView {
 public:
  explicit NodesOfView(const TrueView& view);  // which must outlive it
  // Null where the node is not in sight.
  const NodeTruth* Find(const BoardNode& node) const;
  Verdict Assess(const BoardNode& node, double x_px, double y_px) const;

 private:
  double LargestPitchAround(const BoardNode& node) const;

  const TrueView& view_;
  std::map<BoardNode, const NodeTruth*> nodes_;
};

// An observation with what is true of it.
struct ScoredObservation {
  BoardNode node;
  bool right = false;     // the node is there, within half a pitch
  bool on_crest = false;  // Verdict::kOnCrest
  double error_px = 0, pitch_px = 0;
  float sigma_px = 0, confidence = 0;
  int beyond = 0;     // of its two coordinates, how many are off by more than three sigma
  int neighbors = 0;  // of the 8 around it, observed
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
  // Observed cells that are not where they were observed, those of them that are on a crest (see Verdict),
  // and the share of observed cells that are right.
  size_t WrongCells() const;
  size_t WrongOnCrest() const;
  double Precision() const;
  // Errors of right observations.
  std::vector<double> ErrorsPx(NodeKind kind) const;
};

// Adds a decoding of a view, but for observations that cannot be judged.
void Score(const DecodeResult& result, const TrueView& view, DecodeScore* score);

// Decodes all views in the calling thread; `on_view` (may be empty) is called with the views done.
absl::StatusOr<DecodeScore> DecodeAndScore(const TrueTake& take, const BoardIndex& index,
                                           const DecodeOptions& options,
                                           const std::function<void(size_t)>& on_view = {});

// User time of the calling thread.
double UserSeconds();

}  // namespace weft::testing
