#include "pattern/surface/board_growth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "pattern/surface/occupied_places.h"

namespace weft {
namespace {

constexpr int kMostAttempts = 5;
// A candidate this good needs no second attempt from another neighbour.
constexpr float kWellExplained = 0.75f;

// Candidates by how well they are explained: the best first, in steps of 1 %; of those in one step the one
// that came first. Neighbours come one after the other, and are near each other in memory then.
class CandidateQueue {
 public:
  void Push(float explained, int candidate) {
    const int step = StepOf(explained);
    steps_[step].candidates.push_back(candidate);
    best_ = std::max(best_, step);
  }
  // The next one of those that are explained by this share or more; -1 where there is none.
  int Pop(float least_explained) {
    for (; best_ >= StepOf(least_explained); --best_) {
      Step& step = steps_[best_];
      if (step.next < step.candidates.size()) return step.candidates[step.next++];
      step = {};
      if (best_ == 0) break;
    }
    return -1;
  }
  // The one that comes so many later of those that are equally well explained; -1 where there is none.
  int Ahead(size_t later) const {
    const Step& step = steps_[best_];
    return step.next + later < step.candidates.size() ? step.candidates[step.next + later] : -1;
  }

 private:
  static constexpr int kSteps = 100;
  static int StepOf(float explained) { return std::clamp(static_cast<int>(kSteps * explained), 0, kSteps); }

  struct Step {
    std::vector<int> candidates;
    size_t next = 0;
  };
  std::array<Step, kSteps + 1> steps_;
  int best_ = 0;  // no later step has any
};

class Growth {
 public:
  Growth(const CellFitter& fitter, const Board& board, int width_px, int height_px,
         const GrowthOptions& options, const std::vector<MissingCell>* missing)
      : fitter_(fitter),
        board_(board),
        options_(options),
        wants_missing_(missing != nullptr),
        width_px_(width_px),
        height_px_(height_px),
        on_board_(board.cells.size(), BoardPlace()),
        places_(width_px, height_px) {
    if (missing == nullptr) return;
    for (const MissingCell& miss : *missing) missing_[Index(miss.row, miss.col)] = miss;
  }

  // The cells where growth stopped, after a run.
  std::vector<MissingCell> Missing() const {
    std::vector<MissingCell> missing;
    for (const auto& [cell, miss] : missing_) {
      if (on_board_[cell].taken < 0) missing.push_back(miss);
    }
    return missing;
  }

  GrownCells Run(const GrownCells& known, const std::vector<GrowthSeed>& seeds,
                 const std::function<std::vector<GrowthSeed>(const GrownCells&)>& find_more) {
    cells_.reserve(known.size() + seeds.size() + seeds.size() / 2);
    TakeKnown(known);
    Start(seeds);
    for (const GrownCell& cell : known) TryAround(cell);
    TakeAll(options_.clearly_explained);
    if (find_more) Start(find_more(Taken()));
    TakeAll(-1);
    return Taken();
  }

  GrownCells RunAtRims(const GrownCells& known) {
    at_rims_ = true;
    cells_.reserve(known.size() + known.size() / 8);
    TakeKnown(known);
    for (const GrownCell& cell : known) TryAround(cell);
    TakeAll(-1);
    return Taken();
  }

 private:
  struct BoardPlace {
    int taken = -1;       // index of the cell
    float explained = 0;  // of the best candidate so far
    int attempts = 0;     // at rims: with how many known cells around
  };

  // Ordered by row and column.
  GrownCells Taken() const {
    GrownCells taken;
    taken.reserve(taken_);
    for (const BoardPlace& place : on_board_) {
      if (place.taken >= 0) taken.push_back(cells_[place.taken]);
    }
    return taken;
  }

  void TakeKnown(const GrownCells& known) {
    cells_ = known;
    for (size_t k = 0; k < known.size(); ++k) Take(static_cast<int>(k));
  }

  void Start(const std::vector<GrowthSeed>& seeds) {
    for (const GrowthSeed& seed : seeds) {
      if (!board_.Contains(seed.row, seed.col) || CellAt(seed.row, seed.col) >= 0) continue;
      const CellFit fit = fitter_.Fit(seed.row, seed.col, seed.frame, Weights(seed.row, seed.col, true),
                                      options_.iterations + 2, options_.min_explained);
      if (!WhyNot(fit)) Enqueue({seed.row, seed.col, fit, seed.group, 0});
    }
  }

  // Takes candidates that are explained by this share or more, and those that follow from them.
  void TakeAll(float least_explained) {
    for (int k = queue_.Pop(least_explained); k >= 0; k = queue_.Pop(least_explained)) {
      Prefetch();
      const GrownCell next = cells_[k];
      if (CellAt(next.row, next.col) >= 0) continue;
      if (places_.AreTaken(next.fit.frame)) {
        Miss(next.row, next.col, next.fit.frame, WhyMissing::kTaken);
        continue;
      }
      Take(k);
      TryAround(next);
    }
  }

  // Neighbours in the queue are far from each other in memory.
  void Prefetch() const {
    constexpr size_t kSoon = 2, kLater = 5;
    if (const int later = queue_.Ahead(kLater); later >= 0) __builtin_prefetch(&cells_[later]);
    const int soon = queue_.Ahead(kSoon);
    if (soon < 0) return;
    const GrownCell& cell = cells_[soon];
    places_.Prefetch(cell.fit.frame);
    __builtin_prefetch(&on_board_[Index(cell.row, cell.col)]);
  }

  size_t Index(int row, int col) const { return static_cast<size_t>(row) * board_.cols + col; }
  int CellAt(int row, int col) const {
    return board_.Contains(row, col) ? on_board_[Index(row, col)].taken : -1;
  }

  // Cells not yet known may be hidden: they count less.
  NeighborWeights Weights(int row, int col, bool seed) const {
    NeighborWeights weights;
    for (int k = 0; k < 9; ++k) {
      const bool known = k == 4 || CellAt(row + k / 3 - 1, col + k % 3 - 1) >= 0;
      weights[k] = known || seed ? 1.0f : 0.3f;
    }
    return weights;
  }

  // Nothing for a fit that can be taken.
  std::optional<WhyMissing> WhyNot(const CellFit& fit) const {
    if (!fit.converged) {
      const bool given_up = fit.gain > 0 && fit.explained < options_.min_explained;
      return given_up ? WhyMissing::kNotExplained : WhyMissing::kNoFit;
    }
    if (fit.moved_cells > options_.max_move_cells) return WhyMissing::kMoved;
    if (fit.explained < options_.min_explained) return WhyMissing::kNotExplained;
    if (fit.ink_lead < options_.min_ink_lead * fit.center_contrast * fit.center_contrast)
      return WhyMissing::kOtherInk;
    const CellFrame& f = fit.frame;
    if (f.Area() < options_.min_area_px || f.ShorterEdge() < options_.min_edge_px)
      return WhyMissing::kTooSmall;
    if (!InImage(f)) return WhyMissing::kNoFit;
    return std::nullopt;
  }

  bool InImage(const CellFrame& f) const {
    return f.x >= 0 && f.y >= 0 && f.x <= static_cast<float>(width_px_ - 1) &&
           f.y <= static_cast<float>(height_px_ - 1);
  }

  // Notes where growth stops; where it comes by again the last reason counts.
  void Miss(int row, int col, const CellFrame& at, WhyMissing why) {
    if (wants_missing_ && InImage(at)) missing_[Index(row, col)] = {row, col, at.x, at.y, why};
  }

  void Take(int k) {
    const GrownCell& cell = cells_[k];
    on_board_[Index(cell.row, cell.col)].taken = k;
    ++taken_;
    places_.Take(cell.fit.frame, cell.row, cell.col);
  }

  void Enqueue(const GrownCell& candidate) {
    float& explained = on_board_[Index(candidate.row, candidate.col)].explained;
    explained = std::max(explained, candidate.fit.explained);
    queue_.Push(candidate.fit.explained, static_cast<int>(cells_.size()));
    cells_.push_back(candidate);
  }

  void TryAround(const GrownCell& cell) {
    for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}})
      Try(cell.row + dr, cell.col + dc, dr, dc);
  }

  // Looks for the cell that is (dr, dc) from one just taken.
  void Try(int row, int col, int dr, int dc) {
    if (!board_.Contains(row, col)) return;
    BoardPlace& place = on_board_[Index(row, col)];
    if (at_rims_) {
      if (place.taken < 0) TryAtRim(row, col);
      return;
    }
    if (place.taken >= 0 || place.explained > kWellExplained || place.attempts >= kMostAttempts) return;
    ++place.attempts;
    int group = 0;
    const CellFrame predicted = Predict(row, col, &group);
    const NeighborWeights weights = Weights(row, col, false);
    CellFit fit = fitter_.Fit(row, col, predicted, weights, options_.iterations, options_.min_explained);
    if (WhyNot(fit)) {
      const GrownCell& from = cells_[CellAt(row - dr, col - dc)];
      group = from.group;
      fit = fitter_.Fit(row, col, TurnedAway(from.fit.frame, dr, dc), weights, options_.iterations,
                        options_.min_explained);
      if (const auto why = WhyNot(fit)) return Miss(row, col, predicted, *why);
    }
    Enqueue({row, col, fit, group, 0});
  }

  // Looks for a cell that has enough known ones around; again where there are more now. Where other parts of
  // the print are in front of it, the rest of it is looked at.
  void TryAtRim(int row, int col) {
    constexpr int kLeastLeft = 6;  // of 16 samples on the cell
    int known = 0;
    for (int k = 0; k < 9; ++k) known += CellAt(row + k / 3 - 1, col + k % 3 - 1) >= 0;
    BoardPlace& place = on_board_[Index(row, col)];
    if (known < options_.min_known_at_rims || known == place.attempts) return;
    place.attempts = known;
    int group = 0;
    const CellFrame predicted = Predict(row, col, &group);
    if (!InImage(predicted)) return;
    strangers_.clear();
    places_.FindStrangers(predicted, row, col, &strangers_);
    SampleMask visible;
    if (!strangers_.empty() && MaskCovered(predicted, strangers_, &visible) < kLeastLeft)
      return Miss(row, col, predicted, WhyMissing::kTaken);
    const CellFit fit = fitter_.Fit(row, col, predicted, Weights(row, col, false), options_.iterations,
                                    options_.min_explained, strangers_.empty() ? nullptr : &visible);
    if (const auto why = WhyNot(fit)) return Miss(row, col, predicted, *why);
    Enqueue({row, col, fit, group, 0});
  }

  // The cell (dr, dc) from another where the cloth turns away from the camera: folds end growth in most
  // cases.
  static CellFrame TurnedAway(const CellFrame& from, int dr, int dc) {
    constexpr float kShortened = 0.65f, kStep = 0.5f * (1 + kShortened);
    CellFrame f = from;
    f.x += kStep * (static_cast<float>(dc) * f.ax + static_cast<float>(dr) * f.bx);
    f.y += kStep * (static_cast<float>(dc) * f.ay + static_cast<float>(dr) * f.by);
    for (float* v : {dc != 0 ? &f.ax : &f.bx, dc != 0 ? &f.ay : &f.by}) *v *= kShortened;
    return f;
  }

  // Mean of what the known neighbours say.
  CellFrame Predict(int row, int col, int* group) const {
    CellFrame sum;
    float weights = 0, best = -1;
    for (int dr = -1; dr <= 1; ++dr) {
      for (int dc = -1; dc <= 1; ++dc) {
        const int k = CellAt(row + dr, col + dc);
        if (k < 0) continue;
        const CellFrame& f = cells_[k].fit.frame;
        const float weight = (dr != 0 && dc != 0 ? 0.4f : 1.0f) * cells_[k].fit.explained;
        sum.x += weight * (f.x - static_cast<float>(dc) * f.ax - static_cast<float>(dr) * f.bx);
        sum.y += weight * (f.y - static_cast<float>(dc) * f.ay - static_cast<float>(dr) * f.by);
        sum.ax += weight * f.ax;
        sum.ay += weight * f.ay;
        sum.bx += weight * f.bx;
        sum.by += weight * f.by;
        weights += weight;
        if (weight > best) {
          best = weight;
          *group = cells_[k].group;
        }
      }
    }
    for (float* v : {&sum.x, &sum.y, &sum.ax, &sum.ay, &sum.bx, &sum.by}) *v /= weights;
    return sum;
  }

  const CellFitter& fitter_;
  const Board& board_;
  const GrowthOptions& options_;
  bool wants_missing_;
  bool at_rims_ = false;
  int width_px_, height_px_;
  PixelVector<BoardPlace> on_board_;  // by board cell
  GrownCells cells_;                  // all candidates, taken or not
  size_t taken_ = 0;
  OccupiedPlaces places_;
  std::vector<CellFrame> strangers_;
  CandidateQueue queue_;
  std::map<size_t, MissingCell> missing_;  // by board cell
};

}  // namespace

absl::Status GrowthOptions::Validate() const {
  if (!(min_explained > 0 && min_explained < 1)) {
    return absl::InvalidArgumentError("growth.min_explained must lie in (0, 1)");
  }
  if (!(min_ink_lead >= 0 && min_ink_lead < 1)) {
    return absl::InvalidArgumentError("growth.min_ink_lead must lie in [0, 1)");
  }
  if (!(clearly_explained >= 0 && clearly_explained <= 1)) {
    return absl::InvalidArgumentError("growth.clearly_explained must lie in [0, 1]");
  }
  if (!(max_move_cells > 0 && max_move_cells <= 1)) {
    return absl::InvalidArgumentError("growth.max_move_cells must lie in (0, 1]");
  }
  if (!(min_edge_px > 0)) return absl::InvalidArgumentError("growth.min_edge_px must be above 0");
  if (!(min_area_px > 0)) return absl::InvalidArgumentError("growth.min_area_px must be above 0");
  if (iterations < 1 || iterations > 50)
    return absl::InvalidArgumentError("growth.iterations must lie in 1 to 50");
  if (min_known_at_rims < 1 || min_known_at_rims > 8)
    return absl::InvalidArgumentError("growth.min_known_at_rims must lie in 1 to 8");
  return absl::OkStatus();
}

std::string_view Describe(WhyMissing why) {
  static constexpr std::string_view kWords[kWhyMissing] = {
      "no print could be fitted",
      "not where its neighbours expect it",
      "does not look like the print",
      "another ink fits better",
      "too small",
      "place taken by another cell",
      "found, but not surely enough",
  };
  return kWords[static_cast<int>(why)];
}

GrownCells GrowOnBoard(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                       const GrownCells& known, const std::vector<GrowthSeed>& seeds,
                       const GrowthOptions& options,
                       const std::function<std::vector<GrowthSeed>(const GrownCells&)>& find_more,
                       std::vector<MissingCell>* missing) {
  Growth growth(fitter, board, width_px, height_px, options, missing);
  GrownCells cells = growth.Run(known, seeds, find_more);
  if (missing != nullptr) *missing = growth.Missing();
  return cells;
}

GrownCells GrowAtRims(const CellFitter& fitter, const Board& board, int width_px, int height_px,
                      const GrownCells& known, const GrowthOptions& options,
                      std::vector<MissingCell>* missing) {
  Growth growth(fitter, board, width_px, height_px, options, missing);
  GrownCells cells = growth.RunAtRims(known);
  if (missing != nullptr) *missing = growth.Missing();
  return cells;
}

}  // namespace weft
