#include "pattern/guided_decoding.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "pattern/fit/appearance.h"

namespace weft {
namespace {

constexpr size_t kLeastKnown = 20;
constexpr int kLevels = 4;

// Of found cells, more than this were right wherever the truth is known.
constexpr float kConfidence = 0.99f;

// Errors of neighbouring pixels are alike, which the fit does not know; as in DecodeView.
constexpr float kSigmaFactor = 1.9f;

// Precision of the fit's own belief that a cell is where it was looked for, in units of 1 / noise^2 and
// cells; see CellFitter. It is no measurement, so it is taken out of sigma.
constexpr float kFitPriorPrecision = 522;

absl::StatusOr<std::vector<ColorImage>> ReadPyramid(const Frame& frame) {
  if (absl::Status status = frame.Validate(); !status.ok()) return status;
  if (frame.format == PixelFormat::kGrey8) {
    return absl::InvalidArgumentError(absl::StrCat(frame.origin, ": a grey image cannot be decoded"));
  }
  absl::StatusOr<ColorImage> image = ToColorImage(frame);
  if (!image.ok()) return image.status();
  std::vector<ColorImage> pyramid;
  pyramid.push_back(*std::move(image));
  while (pyramid.size() < kLevels && std::min(pyramid.back().width_px, pyramid.back().height_px) >= 32) {
    pyramid.push_back(HalfSize(pyramid.back()));
  }
  return pyramid;
}

// How the print looks at the known cells.
Appearance LearnAppearance(const std::vector<ColorImage>& pyramid, const Board& board,
                           const SampledProfile& profile, const std::vector<PredictedCell>& known) {
  constexpr float kLight = 128, kBlack = 25, kFade = 0.5f;
  constexpr size_t kCells = 150;
  Appearance start;
  for (int k = 0; k < kCellColors; ++k) {
    const auto rgb = CellColorRgb(static_cast<CellColor>(k));
    for (int c = 0; c < 3; ++c) start.inks[k][c] = kFade * kLight + (1 - kFade) * static_cast<float>(rgb[c]);
  }
  start.black.fill(kBlack);
  std::vector<PlacedCell> cells;
  for (size_t k = 0; k < known.size(); k += std::max<size_t>(1, known.size() / kCells)) {
    cells.push_back({known[k].row, known[k].col, known[k].frame});
  }
  return CalibrateAppearance(pyramid, board, profile, cells,
                             {0.4f, 0.55f, 0.7f, 0.85f, 1.0f, 1.2f, 1.5f, 1.9f, 2.4f, 3.0f, 4.0f}, start);
}

float LongerEdge(const CellFrame& f) { return std::max(std::hypot(f.ax, f.ay), std::hypot(f.bx, f.by)); }

bool LargeEnough(const CellFrame& f, const GuidedOptions& options) {
  return f.Area() >= options.min_area_px && f.Area() >= options.min_width_px * LongerEdge(f);
}

bool Contains(const CellFrame& f, float x, float y) {
  const float dx = x - f.x, dy = y - f.y, area = f.Area();
  const float u = (f.by * dx - f.bx * dy) / area, v = (f.ax * dy - f.ay * dx) / area;
  return std::abs(u) < 0.5f && std::abs(v) < 0.5f;
}

// Places in the image that have a cell.
class TakenPlaces {
 public:
  TakenPlaces(int width_px, int height_px)
      : columns_(width_px / kBucketPx + 1),
        rows_(height_px / kBucketPx + 1),
        buckets_(static_cast<size_t>(columns_) * rows_) {}

  void Add(const CellFrame& frame) { buckets_[Bucket(Column(frame.x), Row(frame.y))].push_back(frame); }

  bool Taken(const CellFrame& frame) const {
    const int reach = 1 + static_cast<int>(LongerEdge(frame)) / kBucketPx;
    for (int y = std::max(0, Row(frame.y) - reach); y <= std::min(rows_ - 1, Row(frame.y) + reach); ++y) {
      for (int x = std::max(0, Column(frame.x) - reach); x <= std::min(columns_ - 1, Column(frame.x) + reach);
           ++x) {
        for (const CellFrame& other : buckets_[Bucket(x, y)]) {
          if (Contains(other, frame.x, frame.y) || Contains(frame, other.x, other.y)) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr int kBucketPx = 8;
  int Column(float x) const { return std::clamp(static_cast<int>(x) / kBucketPx, 0, columns_ - 1); }
  int Row(float y) const { return std::clamp(static_cast<int>(y) / kBucketPx, 0, rows_ - 1); }
  size_t Bucket(int column, int row) const { return static_cast<size_t>(row) * columns_ + column; }

  int columns_, rows_;
  std::vector<std::vector<CellFrame>> buckets_;
};

class GuidedSearch {
 public:
  GuidedSearch(const Board& board, const CellFitter& fitter, const Frame& frame, const GuidedOptions& options)
      : board_(board), fitter_(fitter), frame_(frame), options_(options) {}

  GuidedCell Look(const PredictedCell& wanted) const {
    GuidedCell cell;
    if (!LargeEnough(wanted.frame, options_)) return cell;
    cell.fit = BestFit(wanted);
    cell.verdict = Judge(wanted, &cell);
    return cell;
  }

 private:
  // The best explained of the fits around the predicted place.
  CellFit BestFit(const PredictedCell& wanted) const {
    const float pitch_px = std::sqrt(wanted.frame.Area());
    const float reach = std::min(2 * wanted.sigma_px / pitch_px, options_.max_move_cells);
    const int steps = static_cast<int>(reach / 0.5f);
    CellFit best;
    for (int i = -steps; i <= steps; ++i) {
      for (int j = -steps; j <= steps; ++j) {
        CellFrame start = wanted.frame;
        start.x += 0.5f * (static_cast<float>(j) * start.ax + static_cast<float>(i) * start.bx);
        start.y += 0.5f * (static_cast<float>(j) * start.ay + static_cast<float>(i) * start.by);
        const CellFit fit = fitter_.Fit(wanted.row, wanted.col, start, wanted.in_sight, options_.iterations);
        if (fit.converged && (!best.converged || fit.explained > best.explained)) best = fit;
      }
    }
    return best;
  }

  GuidedVerdict Judge(const PredictedCell& wanted, GuidedCell* cell) const {
    const CellFit& fit = cell->fit;
    const bool vague = wanted.sigma_px > std::min(options_.vague_px, 0.1f * std::sqrt(wanted.frame.Area()));
    const float least = vague ? options_.min_explained_vague : options_.min_explained;
    if (!fit.converged || fit.explained < least || !LargeEnough(fit.frame, options_) ||
        !(fit.frame.x >= 0 && fit.frame.y >= 0 && fit.frame.x <= static_cast<float>(frame_.width_px - 1) &&
          fit.frame.y <= static_cast<float>(frame_.height_px - 1))) {
      return GuidedVerdict::kNoFit;
    }
    cell->explained_alone = ExplainedAlone(wanted, fit.frame);
    if (cell->explained_alone < options_.min_explained_alone) return GuidedVerdict::kCovered;
    if (fit.ink_lead < options_.min_ink_lead * fit.center_contrast * fit.center_contrast) {
      return GuidedVerdict::kOtherInk;
    }
    const float pitch_px = std::sqrt(fit.frame.Area());
    const float in_noise_cells = fit.sigma_px / (std::max(fit.noise, 1e-3f) * pitch_px);
    const float precision = 1 / (in_noise_cells * in_noise_cells) - kFitPriorPrecision;
    const float sigma_cells = precision > 0 ? kSigmaFactor * fit.noise / std::sqrt(precision) : 1e3f;
    cell->sigma_px = sigma_cells * pitch_px;
    const float move_px = std::hypot(fit.frame.x - wanted.frame.x, fit.frame.y - wanted.frame.y);
    cell->miss_sigmas = move_px / std::hypot(wanted.sigma_px, cell->sigma_px);
    if (sigma_cells > options_.max_sigma_cells) return GuidedVerdict::kVague;
    if (cell->miss_sigmas > options_.max_move_sigmas || move_px > options_.max_move_cells * pitch_px) {
      return GuidedVerdict::kMoved;
    }
    cell->lead = fit.explained - BestRival(wanted, fit.frame);
    return cell->lead < (vague ? options_.min_lead_vague : options_.min_lead) ? GuidedVerdict::kRival
                                                                              : GuidedVerdict::kFound;
  }

  float ExplainedAlone(const PredictedCell& wanted, const CellFrame& frame) const {
    NeighborWeights alone{};
    alone[4] = 1;
    return fitter_.Fit(wanted.row, wanted.col, frame, alone, 1).explained;
  }

  // What the print of other places of the board explains at a place.
  float BestRival(const PredictedCell& wanted, const CellFrame& frame) const {
    float best = -1;
    const int reach = options_.rival_cells;
    for (int dr = -reach; dr <= reach; ++dr) {
      for (int dc = -reach; dc <= reach; ++dc) {
        const int row = wanted.row + dr, col = wanted.col + dc;
        if ((dr == 0 && dc == 0) || !board_.Contains(row, col)) continue;
        const CellFit rival = fitter_.Fit(row, col, frame, wanted.in_sight, 1);
        best = std::max(best, rival.explained);
      }
    }
    return best;
  }

  const Board& board_;
  const CellFitter& fitter_;
  const Frame& frame_;
  const GuidedOptions& options_;
};

// A cell of the view at its place, decoded before or found now.
struct SettledCell {
  CellFrame frame;
  float sigma_px = 0;
};
using SettledCells = std::map<std::pair<int, int>, SettledCell>;

// The best explained take their places first; others that claim them lose.
void SettleClaims(const std::vector<PredictedCell>& known, int width_px, int height_px,
                  std::vector<GuidedCell>* cells) {
  TakenPlaces places(width_px, height_px);
  for (const PredictedCell& cell : known) places.Add(cell.frame);
  std::vector<GuidedCell*> order;
  for (GuidedCell& cell : *cells) {
    if (cell.verdict == GuidedVerdict::kFound) order.push_back(&cell);
  }
  std::stable_sort(order.begin(), order.end(), [](const GuidedCell* a, const GuidedCell* b) {
    return a->fit.explained > b->fit.explained;
  });
  for (GuidedCell* cell : order) {
    if (places.Taken(cell->fit.frame)) {
      cell->verdict = GuidedVerdict::kTaken;
    } else {
      places.Add(cell->fit.frame);
    }
  }
}

// The corner (row, col) where the four cells around it are settled; as in DecodeView.
std::optional<Observation> CornerAt(const SettledCells& settled, int row, int col) {
  Observation o;
  o.node = {row, col, NodeKind::kCorner};
  o.confidence = kConfidence;
  double variance_px2 = 0;
  for (int k = 0; k < 4; ++k) {
    const auto at = settled.find({row - 1 + k / 2, col - 1 + k % 2});
    if (at == settled.end()) return std::nullopt;
    const CellFrame& f = at->second.frame;
    const double towards_col = k % 2 == 0 ? 0.25 : -0.25, towards_row = k / 2 == 0 ? 0.25 : -0.25;
    o.x_px += 0.25 * (f.x + towards_col * f.ax + towards_row * f.bx);
    o.y_px += 0.25 * (f.y + towards_col * f.ay + towards_row * f.by);
    variance_px2 += 0.125 * at->second.sigma_px * at->second.sigma_px;
  }
  o.sigma_px = static_cast<float>(std::sqrt(variance_px2));
  return o;
}

std::vector<Observation> Observe(const std::vector<PredictedCell>& known,
                                 const std::vector<PredictedCell>& wanted,
                                 const std::vector<GuidedCell>& cells) {
  SettledCells settled;
  for (const PredictedCell& cell : known) settled[{cell.row, cell.col}] = {cell.frame, cell.sigma_px};
  std::vector<Observation> observations;
  std::set<std::pair<int, int>> corners;
  for (size_t k = 0; k < wanted.size(); ++k) {
    if (cells[k].verdict != GuidedVerdict::kFound) continue;
    const int row = wanted[k].row, col = wanted[k].col;
    const CellFrame& frame = cells[k].fit.frame;
    settled[{row, col}] = {frame, cells[k].sigma_px};
    observations.push_back({frame.x, frame.y, {row, col, NodeKind::kCenter}, cells[k].sigma_px, kConfidence});
    for (int i = 0; i < 4; ++i) corners.emplace(row + i / 2, col + i % 2);
  }
  for (const auto& [row, col] : corners) {
    if (const auto corner = CornerAt(settled, row, col)) observations.push_back(*corner);
  }
  return observations;
}

}  // namespace

std::string_view GuidedVerdictName(GuidedVerdict verdict) {
  static constexpr std::string_view kNames[kGuidedVerdicts] = {
      "found", "too_small", "no_fit", "covered", "other_ink", "moved", "vague", "rival", "taken"};
  return kNames[static_cast<int>(verdict)];
}

absl::Status GuidedOptions::Validate() const {
  const auto bad = [](const char* what) { return absl::InvalidArgumentError(absl::StrCat("guided.", what)); };
  if (!(min_explained > 0 && min_explained < 1)) return bad("min_explained must lie in (0, 1)");
  if (!(min_lead >= -1 && min_lead < 1)) return bad("min_lead must lie in [-1, 1)");
  if (!(vague_px > 0)) return bad("vague_px must be above 0");
  if (!(min_explained_vague > 0 && min_explained_vague < 1))
    return bad("min_explained_vague must lie in (0, 1)");
  if (!(min_lead_vague >= 0 && min_lead_vague < 1)) return bad("min_lead_vague must lie in [0, 1)");
  if (rival_cells < 1 || rival_cells > 5) return bad("rival_cells must lie in 1 to 5");
  if (!(min_explained_alone >= 0 && min_explained_alone < 1)) {
    return bad("min_explained_alone must lie in [0, 1)");
  }
  if (!(min_ink_lead >= 0 && min_ink_lead < 1)) return bad("min_ink_lead must lie in [0, 1)");
  if (!(max_move_sigmas > 0)) return bad("max_move_sigmas must be above 0");
  if (!(max_move_cells > 0 && max_move_cells <= 3)) return bad("max_move_cells must lie in (0, 3]");
  if (!(max_sigma_cells > 0)) return bad("max_sigma_cells must be above 0");
  if (!(min_area_px > 0)) return bad("min_area_px must be above 0");
  if (!(min_width_px > 0)) return bad("min_width_px must be above 0");
  if (iterations < 1 || iterations > 50) return bad("iterations must lie in 1 to 50");
  return absl::OkStatus();
}

absl::StatusOr<GuidedResult> DecodePredicted(const Frame& frame, const Board& board,
                                             const std::vector<PredictedCell>& known,
                                             const std::vector<PredictedCell>& wanted,
                                             const GuidedOptions& options) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  const absl::StatusOr<std::vector<ColorImage>> pyramid = ReadPyramid(frame);
  if (!pyramid.ok()) return pyramid.status();
  GuidedResult result;
  result.cells.resize(wanted.size(), {.verdict = GuidedVerdict::kNoFit});
  if (known.size() < kLeastKnown) return result;
  const SampledProfile profile(board.square_fraction);
  const Appearance appearance = LearnAppearance(*pyramid, board, profile, known);
  const CellFitter fitter(*pyramid, board, profile, appearance);
  const GuidedSearch search(board, fitter, frame, options);
  for (size_t k = 0; k < wanted.size(); ++k) result.cells[k] = search.Look(wanted[k]);

  SettleClaims(known, frame.width_px, frame.height_px, &result.cells);
  result.observations = Observe(known, wanted, result.cells);
  return result;
}

}  // namespace weft
