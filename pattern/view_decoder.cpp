#include "pattern/view_decoder.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "capture/image/mosaic.h"
#include "capture/image/picture_quality.h"
#include "pattern/fit/view_noise.h"
#include "pattern/seeds/patch_extension.h"
#include "pattern/surface/center_sweep.h"
#include "pattern/surface/components.h"
#include "pattern/surface/confidence.h"
#include "pattern/surface/part_rivals.h"
#include "pattern/surface/unexplained_blobs.h"

namespace weft {
namespace {

// A smaller image holds no 3x3 cells that could be read.
constexpr int kLeastSidePx = 9;
// With fewer known cells, a second pass knows too little about the view.
constexpr size_t kLeastKnown = 20;
// Fewer seeds of a lattice may not show the view's inks and blur.
constexpr size_t kFewSeeds = 30;
// A cell that moved by less in the sweep before has settled.
constexpr float kSettledCells = 0.02f;

// Adds the calling thread's processor time, from construction to destruction.
class LapTimer {
 public:
  explicit LapTimer(double* ms) : ms_(*ms) {}
  ~LapTimer() { ms_ += NowMs() - start_ms_; }

 private:
  static double NowMs() {
    timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
  }

  double& ms_;
  double start_ms_ = NowMs();
};

// Nothing but noise: a lens that is covered, or no light. Programs write such images as grey ones.
bool ShowsNothing(const Frame& frame) {
  constexpr int kNoiseLevels = 16;
  const PictureQuality quality = MeasurePicture(frame);
  return quality.high - quality.low < kNoiseLevels;
}

absl::StatusOr<ColorImage> ReadColors(const Frame& frame, Exposure* exposure) {
  WEFT_RETURN_IF_ERROR(frame.Validate());
  if (frame.format == PixelFormat::kGrey8) {
    return absl::InvalidArgumentError(absl::StrCat(
        frame.origin.empty() ? "frame" : frame.origin,
        ShowsNothing(frame) ? ": a grey image that shows nothing; is the lens covered, or the image far too "
                              "dark or too bright?"
        : LooksLikeMosaic(frame)
            ? ": a grey image that looks like a Bayer mosaic; name its order with --mosaic (bayer_rg8, "
              "bayer_gr8, bayer_gb8 or bayer_bg8)"
            : ": a grey image cannot be decoded, colours carry the code; where it is a Bayer mosaic, name "
              "its order with --mosaic"));
  }
  *exposure = MeasureExposure(frame);
  return ToColorImage(exposure->gain > 1 ? Brightened(frame, exposure->gain) : frame);
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

// Some of the seeds. Where they are all of their strips' cells, neighbours that are none are hidden.
std::vector<PredictedCell> SomeOf(const std::vector<PlacedCell>& seeds, bool from_strips) {
  constexpr size_t kCells = 120;
  std::set<std::pair<int, int>> is_seed;
  if (from_strips) {
    for (const PlacedCell& seed : seeds) is_seed.insert({seed.row, seed.col});
  }
  std::vector<PredictedCell> some;
  for (size_t k = 0; k < seeds.size(); k += std::max<size_t>(1, seeds.size() / kCells)) {
    const PlacedCell& seed = seeds[k];
    some.push_back({.row = seed.row, .col = seed.col, .pose = seed.pose});
    for (int n = 0; n < 9; ++n) {
      const bool known = !from_strips || is_seed.contains({seed.row + n / 3 - 1, seed.col + n % 3 - 1});
      some.back().in_sight[n] = known ? 1.0f : 0.0f;
    }
  }
  return some;
}

// Starts from the inks of the patches, and learns the rest from some of the seeds.
Appearance LearnAppearance(const std::vector<ColorImage>& pyramid, const Board& board,
                           const SampledProfile& profile, const InkModel& inks,
                           const std::vector<PredictedCell>& cells) {
  constexpr float kLight = 128, kBlack = 25;  // grey levels to start from
  Appearance start;
  for (int k = 0; k < kCellColors; ++k) {
    for (int c = 0; c < 3; ++c) start.inks[k][c] = kLight * inks.mean(static_cast<CellColor>(k))[c];
  }
  start.black.fill(kBlack);
  Appearance learnt =
      CalibrateAppearance({pyramid, board, profile}, cells,
                          {0.4f, 0.55f, 0.7f, 0.85f, 1.0f, 1.2f, 1.5f, 1.9f, 2.4f, 3.0f, 4.0f}, start);
  learnt.noise = ModelNoiseOf(CellFitter(pyramid, board, profile, learnt), cells);
  return learnt;
}

Observation CenterOf(const ViewCell& cell) {
  return {cell.fit.pose.x,
          cell.fit.pose.y,
          {cell.row, cell.col, NodeKind::kCenter},
          kSigmaFactor * cell.fit.sigma_px,
          cell.confidence};
}

// The corner up and left of a cell, between four known ones, in the middle of them, as the centres were
// fitted.
std::optional<Observation> CornerAt(const BoardState& state, int row, int col) {
  Observation corner;
  corner.node = {row, col, NodeKind::kCorner};
  corner.confidence = 1;
  double variance_px2 = 0;
  for (const auto& [r, c] : {std::pair{row - 1, col - 1}, {row - 1, col}, {row, col - 1}, {row, col}}) {
    const ViewCell* cell = state.Find(r, c);
    if (cell == nullptr) return std::nullopt;
    corner.x_px += 0.25 * cell->fit.pose.x;
    corner.y_px += 0.25 * cell->fit.pose.y;
    // The four windows overlap: their errors are alike by a third, so half of the variance averages out.
    const double sigma_px = kSigmaFactor * cell->fit.sigma_px;
    variance_px2 += 0.125 * sigma_px * sigma_px;
    corner.confidence = std::min(corner.confidence, cell->confidence);
  }
  corner.sigma_px = static_cast<float>(std::sqrt(variance_px2));
  return corner;
}

}  // namespace

absl::StatusOr<std::unique_ptr<ViewDecoder>> ViewDecoder::Read(const Frame& frame, const BoardIndex& board,
                                                               const DecodeOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  std::unique_ptr<ViewDecoder> view(new ViewDecoder(frame, board, options));
  WEFT_RETURN_IF_ERROR(view->ReadAgain(frame));
  return view;
}

ViewDecoder::ViewDecoder(const Frame& frame, const BoardIndex& board, const DecodeOptions& options)
    : board_(board),
      options_(options),
      profile_(board.board().square_fraction),
      state_(board.board(), frame.width_px, frame.height_px, options.explain) {}

absl::Status ViewDecoder::ReadAgain(const Frame& frame) {
  const LapTimer timer(&result_.timings.read_ms);
  if (frame.width_px != state_.width_px() || frame.height_px != state_.height_px()) {
    return absl::InvalidArgumentError(absl::StrCat(frame.origin,
                                                   ": the image has another size than the one that was "
                                                   "decoded first"));
  }
  WEFT_ASSIGN_OR_RETURN(ColorImage image, ReadColors(frame, &exposure_));
  fitter_.reset();
  pyramid_ = Pyramid(std::move(image), options_.levels);
  if (knows_inks_) MakeFitter();
  return absl::OkStatus();
}

size_t ViewDecoder::image_bytes() const {
  size_t bytes = 0;
  for (const ColorImage& image : pyramid_) bytes += image.rgbx.size();
  return bytes;
}

void ViewDecoder::Rest(bool keeps_image) {
  state_.Rest();
  seeds_ = {};
  blobs_ = {};
  if (keeps_image) return;
  fitter_.reset();
  pyramid_.clear();
}

void ViewDecoder::MakeFitter() { fitter_.emplace(pyramid_, board_.board(), profile_, appearance_); }

void ViewDecoder::Decode(const ScoreObserver& on_scored) {
  if (!FindSeeds()) return;
  Grow(kFromSeeds);
  Score(on_scored);
  state_.Evict(options_.confidence.min_to_grow);
  Grow(kWithIsolated);
  Score(on_scored);
  state_.Evict(options_.confidence.min_at_boundary);
  Grow(kBehindOccluders);
  Score(on_scored);
  Finish(on_scored);
}

bool ViewDecoder::FindSeeds() {
  if (state_.width_px() < kLeastSidePx || state_.height_px() < kLeastSidePx) return false;
  std::vector<LevelPatch> patches;
  {
    const LapTimer timer(&result_.timings.lattice_ms);
    patches = FindPatches(pyramid_, options_.keypoints, options_.lattice, &blobs_);
    if (options_.explain) result_.explanation.loose = blobs_;
  }
  const LapTimer timer(&result_.timings.colors_ms);
  inks_ = DecodePatches(board_, options_.patches, &patches);
  for (const LevelPatch& patch : patches) result_.patches.push_back(Report(patch, options_.patches));
  seeds_.first = SeedsOf(patches, board_.board(), options_.patches);
  const bool from_strips = seeds_.first.size() < kFewSeeds && SeedFromStrips(patches);
  AddUnread(patches, options_.patches, &blobs_);
  if (seeds_.first.empty()) return false;
  appearance_ = LearnAppearance(pyramid_, board_.board(), profile_, inks_, SomeOf(seeds_.first, from_strips));
  knows_inks_ = true;
  MakeFitter();
  seeds_.isolated = [this, patches = std::move(patches)](const BoardState& state) {
    std::vector<PlacedCell> seeds = FindIsolatedSeeds(*fitter_, inks_, state, blobs_, options_.isolated);
    std::vector<LevelPatch> strips = ExtendPatches(pyramid_, patches, UnexplainedBlobs(state, blobs_));
    ReadPatches(inks_, board_, &strips);
    const std::vector<PlacedCell> of_strips = SeedsOf(strips, board_.board(), options_.patches);
    seeds.insert(seeds.end(), of_strips.begin(), of_strips.end());
    return seeds;
  };
  return true;
}

// Reads strips at once where a lattice gave few seeds or none; false where they give no more.
bool ViewDecoder::SeedFromStrips(const std::vector<LevelPatch>& patches) {
  std::vector<LooseBlob> blobs = blobs_;
  for (const LevelPatch& patch : patches) {
    for (const Keypoint& p : patch.points) blobs.push_back({p.x_px, p.y_px, patch.level});
  }
  std::vector<LevelPatch> strips = ExtendPatches(pyramid_, patches, blobs);
  const InkModel inks = DecodePatches(board_, options_.patches, &strips);
  std::vector<PlacedCell> seeds = SeedsOf(strips, board_.board(), options_.patches);
  if (seeds.size() <= seeds_.first.size()) return false;
  inks_ = inks;
  seeds_.first = std::move(seeds);
  return true;
}

void ViewDecoder::Grow(const GrowthPolicy& policy) {
  const LapTimer timer(&result_.timings.growth_ms);
  weft::Grow(*fitter_, options_.growth, policy, seeds_, &state_);
}

void ViewDecoder::Score(const ScoreObserver& on_scored) {
  {
    const LapTimer timer(&result_.timings.refinement_ms);
    ScoreCells(*fitter_, &state_);
  }
  if (on_scored) on_scored(state_);
}

void ViewDecoder::Finish(const ScoreObserver& on_scored) {
  state_.Evict(std::min(options_.confidence.min_to_help, options_.confidence.min_to_stay));
  // Of another board's print little is found, by chance in all that was searched.
  DropSmallComponents(options_.confidence.min_component, std::max(state_.cells().size(), LatticeNodes()),
                      &state_);
  Score(on_scored);
  const LapTimer timer(&result_.timings.refinement_ms);
  SweepUnsettled(*fitter_, kSettledCells, &state_);
  state_.Evict(options_.confidence.min_to_stay);
  EvictPartRivals(*fitter_, &state_);
  // Neighbours may have moved a cell at the boundary out of the image.
  const float x_most = static_cast<float>(state_.width_px()) - 0.5f,
              y_most = static_cast<float>(state_.height_px()) - 0.5f;
  state_.Filter([&](size_t k) {
    const CellPose& f = state_.cells()[k].fit.pose;
    return f.x >= -0.5f && f.y >= -0.5f && f.x <= x_most && f.y <= y_most;
  });
  if (LooksLikeChance()) Reject();
}

// A sixth of all random windows are on a large board. So few cells in a view full of lattice, none of them
// with many others, are chance, or a print of another board. `weft decode` of ray-traced views of 14,000 to
// 23,000 cells with another board (500 x 500) found 290 to 714, in components of up to 21 (November 2026).
bool ViewDecoder::LooksLikeChance() const {
  constexpr int kLargeComponent = 50;
  constexpr double kLeastShare = 0.02;
  return static_cast<double>(state_.cells().size()) < kLeastShare * static_cast<double>(LatticeNodes()) &&
         LargestComponent(state_) < kLargeComponent;
}

size_t ViewDecoder::LatticeNodes() const {
  size_t nodes = 0;
  for (const PatchReport& patch : result_.patches) nodes += patch.nodes;
  return nodes;
}

void ViewDecoder::Reject() {
  state_.Filter([](size_t) { return false; });
  for (PatchReport& patch : result_.patches) {
    if (patch.accepted) patch.reason = "too few cells of the view agree";
    patch.accepted = false;
  }
}

absl::StatusOr<std::vector<std::optional<WhyMissing>>> ViewDecoder::Find(
    const std::vector<PredictedCell>& predicted, const GuidedOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (!has_image()) return absl::FailedPreconditionError("the view's image was dropped; read it again");
  if (!fitter_ || state_.cells().size() < kLeastKnown) {
    return std::vector<std::optional<WhyMissing>>(predicted.size(), WhyMissing::kNoFit);
  }
  state_.MarkScored();
  auto missing = FindPredicted(*fitter_, predicted, options, &state_);
  GrowFromFinds();
  if (EvictPartRivals(*fitter_, &state_) == 0) return missing;
  for (size_t k = 0; k < predicted.size(); ++k)
    if (!missing[k] && state_.At(predicted[k].row, predicted[k].col) < 0) missing[k] = WhyMissing::kRival;
  return missing;
}

// Where cloth was missed, what was found shows the way to more than what was predicted. Cells that were there
// and finds stay as sure as they are.
void ViewDecoder::GrowFromFinds() {
  Grow(kNearChanges);
  std::vector<float> sure;  // 0 where it has grown now
  for (const ViewCell& cell : state_.cells()) sure.push_back(cell.confidence);
  ScoreCells(*fitter_, &state_);
  for (size_t k = 0; k < sure.size(); ++k) {
    if (sure[k] > 0) state_.cell(k).confidence = sure[k];
  }
  state_.Evict(options_.confidence.min_to_stay);
}

std::vector<Observation> ViewDecoder::Observations() const {
  std::vector<Observation> observations;
  observations.reserve((options_.corners ? 2 : 1) * state_.cells().size());
  for (const ViewCell& cell : state_.cells()) observations.push_back(CenterOf(cell));
  if (!options_.corners) return observations;
  for (const ViewCell& cell : state_.cells()) {
    if (const auto corner = CornerAt(state_, cell.row, cell.col)) observations.push_back(*corner);
  }
  return observations;
}

float ViewDecoder::GreyLevels() const {
  if (state_.cells().empty()) return 0;
  std::vector<float> lights;
  for (const ViewCell& cell : state_.cells()) lights.push_back(cell.fit.gain);
  float brightest = 0, black = 0;
  for (const Rgb& ink : appearance_.inks)
    brightest = std::max(brightest, *std::max_element(ink.begin(), ink.end()));
  for (const float channel : appearance_.black) black += channel / 3;
  return std::clamp(Median(std::move(lights)) * (brightest - black) / exposure_.step, 1.0f, 255.0f);
}

DecodeResult ViewDecoder::TakeResult() {
  result_.observations = Observations();
  result_.grey_levels = GreyLevels();
  if (options_.explain) {
    for (const ViewCell& cell : state_.cells()) result_.explanation.groups.push_back(cell.group);
    result_.explanation.missing = state_.Missing();
  }
  return std::move(result_);
}

}  // namespace weft
