#include "pattern/surface/growth.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "base/status_macros.h"
#include "pattern/fit/cell_bounds.h"
#include "pattern/surface/occupied_positions.h"

namespace weft {
namespace {

// A candidate this good needs no second attempt from another neighbour.
constexpr float kWellExplained = 0.75f;

// Weight in a fit of neighbours that are not known: they may be hidden.
constexpr float kUnknownWeight = 0.3f;

// To the eight cells around one, those that share an edge first.
struct Direction {
  int rows, columns;
};
constexpr Direction kDirections[8] = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};

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
  Growth(const CellFitter& fitter, const GrowthOptions& options, const GrowthPolicy& policy,
         BoardState* state)
      : fitter_(fitter),
        options_(options),
        policy_(policy),
        limits_(LimitsOf(options, policy)),
        state_(*state),
        occupied_(state->width_px(), state->height_px()) {}

  void Run(const GrowthSeeds& seeds) {
    state_.ForgetAttempts();  // poses have changed since: boundaries are fitted again, centres refined
    const std::vector<PlacedCell> boundary =
        policy_.refits_boundary ? TakeOutBoundary() : std::vector<PlacedCell>();
    const size_t known = state_.cells().size();
    candidates_.reserve(seeds.first.size() + seeds.first.size() / 2 + known / 8);
    for (const ViewCell& cell : state_.cells()) occupied_.Take(cell.fit.pose, cell.row, cell.col);
    if (policy_.from_seeds) Start(seeds.first);
    Start(boundary);
    for (size_t k = 0; k < known; ++k) {
      const ViewCell& cell = state_.cells()[k];
      if (!policy_.near_changes || !state_.IsScored(cell)) TryAround(cell.row, cell.col);
    }
    if (policy_.with_isolated && seeds.isolated) {
      TakeAll(options_.clearly_explained);
      state_.Sort();
      Start(seeds.isolated(state_));
    }
    TakeAll(-1);
    state_.Sort();
  }

 private:
  static FitLimits LimitsOf(const GrowthOptions& options, const GrowthPolicy& policy) {
    FitLimits limits = options.fit;
    if (policy.in_one_step) limits.iterations = 1;
    return limits;
  }

  std::vector<PlacedCell> TakeOutBoundary() {
    constexpr uint32_t kAll = 0b111101111;
    std::vector<PlacedCell> boundary;
    std::vector<uint8_t> is_inside(state_.cells().size());
    for (size_t k = 0; k < is_inside.size(); ++k) {
      const ViewCell& cell = state_.cells()[k];
      is_inside[k] = state_.Around(cell.row, cell.col) == kAll;
      if (!is_inside[k]) boundary.push_back({cell.row, cell.col, cell.fit.pose, cell.group, cell.is_read});
    }
    state_.Filter([&](size_t k) { return is_inside[k]; });
    return boundary;
  }

  void Start(const std::vector<PlacedCell>& seeds) {
    FitLimits limits = options_.fit;
    limits.iterations += 2;
    for (const PlacedCell& seed : seeds) {
      if (!state_.board().Contains(seed.row, seed.col) || state_.At(seed.row, seed.col) >= 0) continue;
      PredictedCell expected{.row = seed.row, .col = seed.col, .pose = seed.pose};
      expected.in_sight.fill(1);
      const CellFit fit = fitter_.Fit(expected, limits);
      if (!WhyNot(fit)) Enqueue({seed.row, seed.col, fit, seed.group, 0, seed.is_read});
    }
  }

  // Takes candidates that are explained by this share or more, and those that follow from them.
  void TakeAll(float least_explained) {
    for (int k = queue_.Pop(least_explained); k >= 0; k = queue_.Pop(least_explained)) {
      Prefetch();
      const ViewCell next = candidates_[k];
      if (state_.At(next.row, next.col) >= 0) continue;
      if (occupied_.IsTaken(next.fit.pose)) {
        state_.Miss(next.row, next.col, next.fit.pose, WhyMissing::kTaken);
        state_.Tried(next.row, next.col) = 0;  // who is there may be evicted
        continue;
      }
      state_.Add(next);
      occupied_.Take(next.fit.pose, next.row, next.col);
      TryAround(next.row, next.col);
    }
  }

  // Neighbours in the queue are far from each other in memory.
  void Prefetch() const {
    constexpr size_t kSoon = 2, kLater = 5;
    if (const int later = queue_.Ahead(kLater); later >= 0) __builtin_prefetch(&candidates_[later]);
    const int soon = queue_.Ahead(kSoon);
    if (soon < 0) return;
    const ViewCell& cell = candidates_[soon];
    occupied_.Prefetch(cell.fit.pose);
    state_.Prefetch(cell.row, cell.col);
  }

  // Nothing for a fit that can be taken.
  std::optional<WhyMissing> WhyNot(const CellFit& fit) const {
    if (const auto why = Reject(fit, options_.fit)) return why;
    if (!state_.InImage(fit.pose)) return WhyMissing::kNoFit;
    return std::nullopt;
  }

  void Enqueue(const ViewCell& candidate) {
    float& best = state_.BestExplained(candidate.row, candidate.col);
    best = std::max(best, candidate.fit.explained);
    // What was read is certain, and comes before what follows from it.
    queue_.Push(candidate.is_read ? 1 : candidate.fit.explained, static_cast<int>(candidates_.size()));
    candidates_.push_back(candidate);
  }

  void TryAround(int row, int col) {
    for (int k = 0; k < (policy_.from_diagonals ? 8 : 4); ++k) Try(row, col, k);
  }

  // Looks for the cell that is in direction k of a known one, where that one alone expects it: a mean over
  // all known neighbours is worse where the cloth bends, and the next neighbour would try nothing new. Each
  // neighbour tries once.
  void Try(int known_row, int known_col, int k) {
    const Direction& direction = kDirections[k];
    const int row = known_row + direction.rows, col = known_col + direction.columns;
    if (!state_.board().Contains(row, col) || state_.At(row, col) >= 0 ||
        state_.BestExplained(row, col) > kWellExplained) {
      return;
    }
    uint32_t& tried = state_.Tried(row, col);
    if ((tried >> k & 1) != 0) return;
    const uint32_t around = state_.Around(row, col);
    if (policy_.behind_occluders && __builtin_popcount(around) < options_.min_known_at_boundary) return;
    tried |= 1u << k;
    const ViewCell& from = *state_.Find(known_row, known_col);
    const PredictedCell expected{row, col, Next(from.fit.pose, direction, 1), InSight(around)};
    if (policy_.behind_occluders) {
      TryBehindOccluders(expected, from.group);
    } else {
      TryInTheOpen(expected, TurnedAway(from.fit.pose, direction), from.group);
    }
  }

  // Where the expected pose does not fit, the cloth may turn away.
  void TryInTheOpen(PredictedCell expected, const CellPose& turned_away, int group) {
    if (state_.InImage(expected.pose) && occupied_.IsTaken(expected.pose))
      return state_.Miss(expected.row, expected.col, expected.pose, WhyMissing::kTaken);
    CellFit fit = fitter_.Fit(expected, limits_);
    if (WhyNot(fit)) {
      const CellPose first = std::exchange(expected.pose, turned_away);
      fit = fitter_.Fit(expected, limits_);
      if (const auto why = WhyNot(fit)) return state_.Miss(expected.row, expected.col, first, *why);
    }
    Enqueue({expected.row, expected.col, fit, group, 0});
  }

  // Where other parts of the print are in front of the cell, the rest of it is fitted.
  void TryBehindOccluders(const PredictedCell& expected, int group) {
    constexpr int kLeastLeft = 6;  // of 16 samples on the cell
    const int row = expected.row, col = expected.col;
    const CellPose& pose = expected.pose;
    if (!state_.InImage(pose)) return;
    occluders_.clear();
    occupied_.FindOccluders(pose, row, col, &occluders_);
    SampleMask visible;
    if (!occluders_.empty() && MaskCovered(pose, occluders_, &visible) < kLeastLeft)
      return state_.Miss(row, col, pose, WhyMissing::kTaken);
    const CellFit fit = fitter_.Fit(expected, limits_, occluders_.empty() ? nullptr : &visible);
    if (const auto why = WhyNot(fit)) return state_.Miss(row, col, pose, *why);
    Enqueue({row, col, fit, group, 0});
  }

  // The pose of the next cell in a direction, whose edges are `length` times as long as those of `from`, in
  // between half that change.
  static CellPose Next(const CellPose& from, const Direction& direction, float length) {
    const float half = 0.5f * (1 + length);
    CellPose f =
        from.Shifted(half * static_cast<float>(direction.columns), half * static_cast<float>(direction.rows));
    for (float* v : {direction.columns != 0 ? &f.ax : &f.bx, direction.columns != 0 ? &f.ay : &f.by})
      *v *= length;
    return f;
  }

  // The same where the cloth turns away from the camera: folds end growth in most cases.
  static CellPose TurnedAway(const CellPose& from, const Direction& direction) {
    return Next(from, direction, 0.65f);
  }

  static NeighborWeights InSight(uint32_t around) {
    NeighborWeights in_sight;
    for (int k = 0; k < 9; ++k) in_sight[k] = k == 4 || (around >> k & 1) != 0 ? 1.0f : kUnknownWeight;
    return in_sight;
  }

  const CellFitter& fitter_;
  const GrowthOptions& options_;
  const GrowthPolicy& policy_;
  const FitLimits limits_;  // of all but seeds
  BoardState& state_;
  PixelVector<ViewCell> candidates_;  // taken or not
  OccupiedPositions occupied_;
  std::vector<CellPose> occluders_;
  CandidateQueue queue_;
};

}  // namespace

absl::Status GrowthOptions::Validate() const {
  WEFT_RETURN_IF_ERROR(fit.Validate("growth.fit"));
  if (!(clearly_explained >= 0 && clearly_explained <= 1)) {
    return absl::InvalidArgumentError("growth.clearly_explained must lie in [0, 1]");
  }
  if (min_known_at_boundary < 1 || min_known_at_boundary > 8)
    return absl::InvalidArgumentError("growth.min_known_at_boundary must lie in 1 to 8");
  return absl::OkStatus();
}

void Grow(const CellFitter& fitter, const GrowthOptions& options, const GrowthPolicy& policy,
          const GrowthSeeds& seeds, BoardState* state) {
  Growth(fitter, options, policy, state).Run(seeds);
}

}  // namespace weft
