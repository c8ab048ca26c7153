#include "pattern/surface/predicted_cells.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "pattern/surface/occupied_positions.h"

namespace weft {
namespace {

// Rows and columns around a cell whose print it has to lead.
constexpr int kRivalCells = 2;

// Positions known less well than this, or than a tenth of a cell, are vague.
constexpr float kVaguePx = 0.5f;

// Share of the variance within the cell alone: its neighbours may be in sight where it is covered.
constexpr float kMinExplainedAlone = 0.15f;

// How much better the expected ink must fit than any other; as FitLimits::min_ink_lead.
constexpr float kMinInkLead = 0.3f;

// Least size of a cell in the image: its area, and its area over its longer edge.
constexpr float kMinAreaPx = 4;
constexpr float kMinWidthPx = 1.2f;

constexpr int kIterations = 6;

// Of found cells, more than this were right wherever the truth is known.
constexpr float kConfidence = 0.99f;

bool LargeEnough(const CellPose& f) {
  return f.Area() >= kMinAreaPx && f.Area() >= kMinWidthPx * f.LongerEdge();
}

// A predicted cell as the image shows it.
struct Finding {
  CellFit fit;
  std::optional<WhyMissing> missing;
};

class PredictedSearch {
 public:
  PredictedSearch(const CellFitter& fitter, const GuidedOptions& options, const BoardState& state)
      : fitter_(fitter), options_(options), state_(state) {}

  Finding Find(const PredictedCell& wanted) const {
    if (state_.At(wanted.row, wanted.col) >= 0) return {.fit = {}, .missing = WhyMissing::kTaken};
    if (!LargeEnough(wanted.pose)) return {.fit = {}, .missing = WhyMissing::kTooSmall};
    Finding finding{.fit = BestFit(wanted), .missing = {}};
    finding.missing = Check(wanted, &finding.fit);
    return finding;
  }

 private:
  // The best explained of the fits around the predicted position.
  CellFit BestFit(const PredictedCell& wanted) const {
    const float pitch_px = std::sqrt(wanted.pose.Area());
    const float reach = std::min(2 * wanted.sigma_px / pitch_px, options_.max_move_cells);
    const int steps = static_cast<int>(reach / 0.5f);
    CellFit best;
    for (int i = -steps; i <= steps; ++i) {
      for (int j = -steps; j <= steps; ++j) {
        PredictedCell start = wanted;
        start.pose.x +=
            0.5f * (static_cast<float>(j) * start.pose.ax + static_cast<float>(i) * start.pose.bx);
        start.pose.y +=
            0.5f * (static_cast<float>(j) * start.pose.ay + static_cast<float>(i) * start.pose.by);
        const CellFit fit = fitter_.Fit(start, Steps(kIterations));
        if (fit.converged && (!best.converged || fit.explained > best.explained)) best = fit;
      }
    }
    return best;
  }

  // Replaces sigma_px by that of the image alone.
  std::optional<WhyMissing> Check(const PredictedCell& wanted, CellFit* fit) const {
    const bool vague = wanted.sigma_px > std::min(kVaguePx, 0.1f * std::sqrt(wanted.pose.Area()));
    const float least = vague ? options_.min_explained_vague : options_.min_explained;
    if (!fit->converged || fit->explained < least || !LargeEnough(fit->pose) || !state_.InImage(fit->pose)) {
      return WhyMissing::kNoFit;
    }
    if (ExplainedAlone(wanted, fit->pose) < kMinExplainedAlone) return WhyMissing::kCovered;
    if (fit->ink_lead < kMinInkLead * fit->center_contrast * fit->center_contrast) {
      return WhyMissing::kOtherInk;
    }
    const float pitch_px = std::sqrt(fit->pose.Area());
    fit->sigma_px = SigmaOfImage(*fit, fitter_.noise());
    const float sigma_px = kSigmaFactor * fit->sigma_px;
    if (sigma_px > options_.max_sigma_cells * pitch_px) return WhyMissing::kVague;
    const float move_px = std::hypot(fit->pose.x - wanted.pose.x, fit->pose.y - wanted.pose.y);
    if (move_px > options_.max_move_sigmas * std::hypot(wanted.sigma_px, sigma_px) ||
        move_px > options_.max_move_cells * pitch_px) {
      return WhyMissing::kMoved;
    }
    const float lead = fit->explained - BestRival(wanted, fit->pose);
    if (lead < (vague ? options_.min_lead_vague : options_.min_lead)) return WhyMissing::kRival;
    return std::nullopt;
  }

  static FitLimits Steps(int iterations) { return {.iterations = iterations, .min_explained = -1e9f}; }

  float ExplainedAlone(const PredictedCell& wanted, const CellPose& pose) const {
    PredictedCell alone{.row = wanted.row, .col = wanted.col, .pose = pose};
    alone.in_sight[4] = 1;
    return fitter_.Fit(alone, Steps(1)).explained;
  }

  // What the print of other parts of the board explains at a position.
  float BestRival(const PredictedCell& wanted, const CellPose& pose) const {
    float best = -1;
    const int reach = kRivalCells;
    for (int dr = -reach; dr <= reach; ++dr) {
      for (int dc = -reach; dc <= reach; ++dc) {
        PredictedCell rival = wanted;
        rival.row += dr;
        rival.col += dc;
        rival.pose = pose;
        if ((dr == 0 && dc == 0) || !state_.board().Contains(rival.row, rival.col)) continue;
        best = std::max(best, fitter_.Fit(rival, Steps(1)).explained);
      }
    }
    return best;
  }

  const CellFitter& fitter_;
  const GuidedOptions& options_;
  const BoardState& state_;
};

}  // namespace

absl::Status GuidedOptions::Validate() const {
  const auto bad = [](const char* what) { return absl::InvalidArgumentError(absl::StrCat("guided.", what)); };
  if (!(min_explained > 0 && min_explained < 1)) return bad("min_explained must lie in (0, 1)");
  if (!(min_lead >= -1 && min_lead < 1)) return bad("min_lead must lie in [-1, 1)");
  if (!(min_explained_vague > 0 && min_explained_vague < 1))
    return bad("min_explained_vague must lie in (0, 1)");
  if (!(min_lead_vague >= 0 && min_lead_vague < 1)) return bad("min_lead_vague must lie in [0, 1)");
  if (!(max_move_sigmas > 0)) return bad("max_move_sigmas must be above 0");
  if (!(max_move_cells > 0 && max_move_cells <= 3)) return bad("max_move_cells must lie in (0, 3]");
  if (!(max_sigma_cells > 0)) return bad("max_sigma_cells must be above 0");
  return absl::OkStatus();
}

std::vector<std::optional<WhyMissing>> FindPredicted(const CellFitter& fitter,
                                                     const std::vector<PredictedCell>& predicted,
                                                     const GuidedOptions& options, BoardState* state) {
  const PredictedSearch search(fitter, options, *state);
  std::vector<CellFit> fits(predicted.size());
  std::vector<std::optional<WhyMissing>> missing(predicted.size());
  std::vector<size_t> found;
  for (size_t k = 0; k < predicted.size(); ++k) {
    const Finding finding = search.Find(predicted[k]);
    fits[k] = finding.fit;
    missing[k] = finding.missing;
    if (!missing[k]) found.push_back(k);
  }
  // The best explained take their positions first; others that claim them lose.
  OccupiedPositions occupied(state->width_px(), state->height_px());
  for (const ViewCell& cell : state->cells()) occupied.Take(cell.fit.pose, cell.row, cell.col);
  std::stable_sort(found.begin(), found.end(),
                   [&](size_t a, size_t b) { return fits[a].explained > fits[b].explained; });
  for (const size_t k : found) {
    if (occupied.IsTaken(fits[k].pose)) {
      missing[k] = WhyMissing::kTaken;
      continue;
    }
    occupied.Take(fits[k].pose, predicted[k].row, predicted[k].col);
    state->Add({predicted[k].row, predicted[k].col, fits[k], 0, kConfidence});
  }
  state->Sort();
  return missing;
}

}  // namespace weft
