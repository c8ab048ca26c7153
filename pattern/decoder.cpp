#include "pattern/decoder.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/mosaic.h"
#include "pattern/fit/appearance.h"
#include "pattern/fit/sampled_profile.h"
#include "pattern/seeds/patch_search.h"

namespace weft {
namespace {

// A smaller image holds no 3x3 cells that could be read.
constexpr int kLeastSidePx = 9;

// Residuals of neighbouring pixels are alike, which the fit does not know: measured errors are this much
// larger. Ray-traced views ask for 1.6 without compression and 2.1 as JPEG files.
constexpr float kSigmaFactor = 1.9f;

// Processor time of the calling thread.
class Stopwatch {
 public:
  double LapMs() {
    const double now_ms = NowMs(), ms = now_ms - start_ms_;
    start_ms_ = now_ms;
    return ms;
  }

 private:
  static double NowMs() {
    timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
  }

  double start_ms_ = NowMs();
};

absl::StatusOr<ColorImage> ReadColors(const Frame& frame) {
  if (absl::Status status = frame.Validate(); !status.ok()) return status;
  if (frame.format == PixelFormat::kGrey8) {
    return absl::InvalidArgumentError(absl::StrCat(
        frame.origin.empty() ? "frame" : frame.origin,
        LooksLikeMosaic(frame)
            ? ": a grey image that looks like a Bayer mosaic; name its order with --mosaic (bayer_rg8, "
              "bayer_gr8, bayer_gb8 or bayer_bg8)"
            : ": a grey image cannot be decoded, colours carry the code; where it is a Bayer mosaic, name "
              "its "
              "order with --mosaic"));
  }
  return ToColorImage(frame);
}

// The image and its halvings.
std::vector<ColorImage> Pyramid(ColorImage full, int levels) {
  std::vector<ColorImage> pyramid;
  pyramid.push_back(std::move(full));
  for (int level = 1; level < levels; ++level) {
    ColorImage half = HalfSize(pyramid.back());
    if (half.width_px < kLeastSidePx || half.height_px < kLeastSidePx) break;
    pyramid.push_back(std::move(half));
  }
  return pyramid;
}

PatchReport Report(const LevelPatch& patch, const PatchDecodeOptions& options) {
  PatchReport report;
  report.nodes = static_cast<int>(patch.points.size());
  report.x_min_px = report.x_max_px = patch.points[0].x_px;
  report.y_min_px = report.y_max_px = patch.points[0].y_px;
  for (const Keypoint& p : patch.points) {
    report.x_min_px = std::min<double>(report.x_min_px, p.x_px);
    report.x_max_px = std::max<double>(report.x_max_px, p.x_px);
    report.y_min_px = std::min<double>(report.y_min_px, p.y_px);
    report.y_max_px = std::max<double>(report.y_max_px, p.y_px);
  }
  report.reason = "pattern not found on the board (wrong board, blur, fold)";
  for (const DecodedPiece& piece : patch.pieces) {
    const std::string reason = WhyRejected(patch, piece, options);
    if (&piece == &patch.pieces.front() || reason.empty()) {
      report.reason = reason;
      report.margin = piece.margin;
    }
    if (reason.empty()) break;
  }
  report.accepted = report.reason.empty();
  return report;
}

// Starts from the inks of the patches, and learns the rest from some of the seeds.
Appearance LearnAppearance(const std::vector<ColorImage>& pyramid, const Board& board,
                           const SampledProfile& profile, const InkModel& inks,
                           const std::vector<GrowthSeed>& seeds) {
  constexpr float kLight = 128, kBlack = 25;  // grey levels to start from
  constexpr size_t kCells = 120;
  Appearance start;
  for (int k = 0; k < kCellColors; ++k) {
    for (int c = 0; c < 3; ++c) start.inks[k][c] = kLight * inks.mean(static_cast<CellColor>(k))[c];
  }
  start.black.fill(kBlack);
  std::vector<PlacedCell> cells;
  for (size_t k = 0; k < seeds.size(); k += std::max<size_t>(1, seeds.size() / kCells)) {
    cells.push_back({seeds[k].row, seeds[k].col, seeds[k].frame});
  }
  return CalibrateAppearance(pyramid, board, profile, cells,
                             {0.4f, 0.55f, 0.7f, 0.85f, 1.0f, 1.2f, 1.5f, 1.9f, 2.4f, 3.0f, 4.0f}, start);
}

void AddCenters(const GrownCells& cells, std::vector<Observation>* observations) {
  for (const GrownCell& cell : cells) {
    Observation o;
    o.x_px = cell.fit.frame.x;
    o.y_px = cell.fit.frame.y;
    o.node = {cell.row, cell.col, NodeKind::kCenter};
    o.sigma_px = kSigmaFactor * cell.fit.sigma_px;
    o.confidence = cell.confidence;
    observations->push_back(o);
  }
}

// Corners between four known cells, in the middle of them, as the centres were fitted.
void AddCorners(const GrownCells& cells, std::vector<Observation>* observations) {
  // Index of the cell up and left of the current one, or else of the first after that place; moves on.
  size_t above = 0;
  const auto is_at = [&](size_t k, int row, int col) {
    return k < cells.size() && cells[k].row == row && cells[k].col == col;
  };
  for (size_t k = 0; k < cells.size(); ++k) {
    const int row = cells[k].row, col = cells[k].col;
    while (std::pair{cells[above].row, cells[above].col} < std::pair{row - 1, col - 1}) ++above;
    if (!is_at(above, row - 1, col - 1) || !is_at(above + 1, row - 1, col) || k == 0 ||
        !is_at(k - 1, row, col - 1)) {
      continue;
    }
    Observation o;
    o.node = {row, col, NodeKind::kCorner};
    o.confidence = 1;
    double variance_px2 = 0;
    const GrownCell* const around[] = {&cells[above], &cells[above + 1], &cells[k - 1], &cells[k]};
    for (int n = 0; n < 4; ++n) {
      o.x_px += 0.25 * around[n]->fit.frame.x;
      o.y_px += 0.25 * around[n]->fit.frame.y;
      // The four windows overlap: their errors are alike by a third, so half of the variance averages out.
      const double sigma_px = kSigmaFactor * around[n]->fit.sigma_px;
      variance_px2 += 0.125 * sigma_px * sigma_px;
      o.confidence = std::min(o.confidence, around[n]->confidence);
    }
    o.sigma_px = static_cast<float>(std::sqrt(variance_px2));
    observations->push_back(o);
  }
}

void AddUnsure(const Regrowth& rims, std::vector<MissingCell>* missing) {
  size_t next = 0;
  for (const GrownCell& cell : rims.judged) {
    if (next < rims.known.size() && rims.known[next].row == cell.row && rims.known[next].col == cell.col) {
      ++next;
    } else {
      const CellFrame& f = cell.fit.frame;
      missing->push_back({cell.row, cell.col, f.x, f.y, WhyMissing::kUnsure});
    }
  }
}

// Groups of the cells that stayed, and those that were grown and dropped again.
void ExplainCells(const GrownCells& grown, const GrownCells& stayed, DecodeExplanation* explanation) {
  size_t next = 0;
  for (const GrownCell& cell : grown) {
    if (next < stayed.size() && stayed[next].row == cell.row && stayed[next].col == cell.col) {
      explanation->groups.push_back(cell.group);
      ++next;
    } else {
      const CellFrame& f = cell.fit.frame;
      explanation->missing.push_back({cell.row, cell.col, f.x, f.y, WhyMissing::kUnsure});
    }
  }
}

// A sixth of all random windows are on a large board. So few cells in a view full of lattice are chance, or a
// print of another board.
bool LooksLikeChance(const std::vector<PatchReport>& patches, const GrownCells& cells) {
  constexpr size_t kEnoughCells = 50;
  constexpr double kLeastShare = 0.02;
  double nodes = 0;
  for (const PatchReport& patch : patches) nodes += patch.nodes;
  return cells.size() < kEnoughCells && static_cast<double>(cells.size()) < kLeastShare * nodes;
}

}  // namespace

absl::Status DecodeOptions::Validate() const {
  if (levels < 1 || levels > 8) return absl::InvalidArgumentError("levels must lie in 1 to 8");
  for (const absl::Status& status : {keypoints.Validate(), lattice.Validate(), patches.Validate(),
                                     growth.Validate(), islands.Validate(), refinement.Validate()}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::StatusOr<DecodeResult> DecodeView(const Frame& frame, const BoardIndex& board,
                                        const DecodeOptions& options) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  Stopwatch watch;
  absl::StatusOr<ColorImage> image = ReadColors(frame);
  if (!image.ok()) return image.status();
  DecodeResult result;
  result.timings.read_ms = watch.LapMs();
  if (image->width_px < kLeastSidePx || image->height_px < kLeastSidePx) return result;
  const std::vector<ColorImage> pyramid = Pyramid(*std::move(image), options.levels);
  std::vector<LooseSpot> loose;
  std::vector<LevelPatch> patches = FindPatches(pyramid, options.keypoints, options.lattice, &loose);
  if (options.explain) result.explanation.loose = loose;
  result.timings.lattice_ms = watch.LapMs();
  const InkModel inks = DecodePatches(board, options.patches, &patches);
  for (const LevelPatch& patch : patches) result.patches.push_back(Report(patch, options.patches));
  const std::vector<GrowthSeed> seeds = SeedsOf(patches, board.board(), options.patches);
  result.timings.colors_ms = watch.LapMs();
  if (seeds.empty()) return result;

  const SampledProfile profile(board.board().square_fraction);
  const Appearance appearance = LearnAppearance(pyramid, board.board(), profile, inks, seeds);
  const CellFitter fitter(pyramid, board.board(), profile, appearance);
  AddUnread(patches, options.patches, &loose);
  const auto find_islands = [&](const GrownCells& known) {
    return FindIslandSeeds(fitter, pyramid, board.board(), inks, known, loose, options.islands);
  };
  const int width_px = frame.width_px, height_px = frame.height_px;
  std::vector<MissingCell>* const missing = options.explain ? &result.explanation.missing : nullptr;
  GrownCells cells = GrowOnBoard(fitter, board.board(), width_px, height_px, {}, seeds, options.growth);
  Regrowth again = RegrowthFrom(fitter, board.board(), width_px, height_px, options.refinement, cells);
  cells = GrowOnBoard(fitter, board.board(), width_px, height_px, again.known, again.seeds, options.growth,
                      find_islands, missing);
  again =
      RegrowthAtRims(fitter, board.board(), width_px, height_px, options.refinement, again, std::move(cells));
  if (missing != nullptr) AddUnsure(again, missing);
  cells = GrowAtRims(fitter, board.board(), width_px, height_px, again.known, options.growth, missing);
  result.timings.growth_ms = watch.LapMs();
  const GrownCells grown = options.explain ? cells : GrownCells();
  RefineCells(fitter, board.board(), width_px, height_px, options.refinement, again, &cells);
  if (LooksLikeChance(result.patches, cells)) {
    cells.clear();
    for (PatchReport& patch : result.patches) {
      if (patch.accepted) patch.reason = "too few cells of the view agree";
      patch.accepted = false;
    }
  }
  if (options.explain) ExplainCells(grown, cells, &result.explanation);
  result.observations.reserve((options.corners ? 2 : 1) * cells.size());
  AddCenters(cells, &result.observations);
  if (options.corners) AddCorners(cells, &result.observations);
  result.timings.refinement_ms = watch.LapMs();
  return result;
}

}  // namespace weft
