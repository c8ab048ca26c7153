#include "pattern/fit/cell_fitter.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pattern/fit/cell_equations.h"

namespace weft {
namespace {

constexpr float kShapePrior = 0.12f;  // per cell
constexpr float kLongestStep = 0.3f;  // cells
// In cells; a shorter step ends the iterations. Growth only has to come near, centres are refined together
// later: from 0.02 to 0.06, recall gains 0.05 to 0.8 points, and 0.2 loses 1.6 again. accuracy_decode on
// takes of `weft simulate` (quickstart with seed 11, tshirt-24 with seed 12, gathers, curls, pleats),
// November 2026.
constexpr float kShortestStep = 0.06f;
// How far the explained share ends above what the first step predicts, the second, the third; and in a fit of
// one step. It is less in 99.9 % of the fits. `refit_decode rejection` on the takes and layers that
// confidence is fitted to (docs/decoding-accuracy.md), November 2026.
constexpr float kAbovePrediction[] = {0.41f, 0.18f, 0.04f}, kAbovePredictionOfOne = 0.25f;
constexpr int kLeastSamples = 12;  // in the image
constexpr float kLeastAreaPx2 = 1.0f, kMostAreaPx2 = 4000.0f;

// The pose after the map (u, v) -> (u, v) + step over (1, u, v).
CellPose Moved(const CellPose& f, const SmallVector<6>& step) {
  const float uu = 1 + step[1], uv = step[2], vu = step[4], vv = 1 + step[5];
  const float inverse = 1 / (uu * vv - uv * vu);
  CellPose out;
  out.ax = inverse * (f.ax * vv - f.bx * vu);
  out.ay = inverse * (f.ay * vv - f.by * vu);
  out.bx = inverse * (f.bx * uu - f.ax * uv);
  out.by = inverse * (f.by * uu - f.ay * uv);
  out.x = f.x - (out.ax * step[0] + out.bx * step[3]);
  out.y = f.y - (out.ay * step[0] + out.by * step[3]);
  return out;
}

float Length(float x, float y) { return std::sqrt(x * x + y * y); }

// Compares the expected ink with the others on the cell itself.
void ScoreInk(const std::array<std::array<float, 4>, kCellColors + 1>& colors, int expected,
              const CellModelSums& model, const CellImageSums& image, CellFit* fit) {
  constexpr float kSamples = 3 * 16;
  float with_shape[3];
  for (int c = 0; c < 3; ++c) {
    with_shape[c] = image.shape_i[c] - fit->gain * model.shape_t[c] - fit->offset * model.shape;
  }
  fit->ink_lead = fit->center_contrast = 1e9f;
  for (int k = 0; k < kCellColors; ++k) {
    if (k == expected) continue;
    float squared = 0, mixed = 0;
    for (int c = 0; c < 3; ++c) {
      const float change = (colors[k][c] - colors[expected][c]) * fit->gain;
      squared += change * change;
      mixed += change * with_shape[c];
    }
    squared *= model.shape2;
    fit->ink_lead = std::min(fit->ink_lead, (squared - 2 * mixed) / kSamples);
    fit->center_contrast = std::min(fit->center_contrast, squared / kSamples);
  }
  fit->center_contrast = std::sqrt(fit->center_contrast);
}

// What the image shows where a cell is expected.
class Window {
 public:
  // `visible` may be null.
  Window(const CellKernels& kernels, const PixelView& image, const CellPrint& print,
         const SampleMask* visible = nullptr)
      : kernels_(kernels), image_(image), print_(print), visible_(visible) {}

  // Fills the sums and the light for the cell at `pose`, in px of the image; false where the print cannot be
  // there.
  bool Evaluate(const CellPose& pose, const CellWarp& warp, CellFit* fit) {
    const Inside inside = WhereIs(pose, warp, image_.width_px, image_.height_px);
    if (inside == Inside::kNone) return false;
    if (inside == Inside::kSome) {
      SampleMask mask;
      if (MaskOutside(pose, warp, image_.width_px, image_.height_px, &mask) < kLeastSamples) return false;
      rendered_ = false;
      if (!Render(&mask) || !(model.sums.shape > 0)) return false;
    } else if (!rendered_) {
      rendered_ = true;
      if (!Render(nullptr) || !(model.sums.shape > 0)) return false;
    }
    kernels_.sample(image_, pose, warp, &samples_);
    kernels_.sum(model, samples_, &sums);
    return light.Solve(model.sums, sums, fit);
  }

  // Solves once more with samples that are not like the print counting less: something else may be in front
  // of it there. False where nothing of the print is left.
  bool TrustPrint(CellFit* fit) {
    SampleMask trust;
    kernels_.trust(model, samples_, light.solved.data(), trust.weights.data());
    rendered_ = false;
    if (!Render(&trust)) return false;
    kernels_.sum(model, samples_, &sums);
    return light.Solve(model.sums, sums, fit);
  }

  CellModel model;
  CellImageSums sums;
  WindowLight light;
  int renderings = 0;

 private:
  // `mask` may be null.
  bool Render(SampleMask* mask) {
    if (visible_ != nullptr && mask != nullptr) {
      for (size_t k = 0; k < mask->weights.size(); ++k) mask->weights[k] *= visible_->weights[k];
    }
    const SampleMask* const weights = mask != nullptr ? mask : visible_;
    kernels_.render(print_, weights != nullptr ? weights->weights.data() : nullptr, &model);
    ++renderings;
    return light.Prepare(model.sums);
  }

  const CellKernels& kernels_;
  const PixelView& image_;
  const CellPrint& print_;
  const SampleMask* visible_;
  CellSamples samples_;
  bool rendered_ = false;
};

}  // namespace

CellFitter::CellFitter(const std::vector<ColorImage>& pyramid, const Board& board,
                       const SampledProfile& profile, const Appearance& appearance)
    : pyramid_(pyramid),
      board_(board),
      labels_(static_cast<size_t>(board.rows + 4) * (board.cols + 4), kCellColors),
      profile_(profile),
      appearance_(appearance),
      kernels_(BestCellKernels()) {
  const float variance = noise() * noise();
  const float position = variance / (kPositionPrior * kPositionPrior),
              shape = variance / (kShapePrior * kShapePrior);
  prior_ = {position, shape, shape, position, shape, shape};
  colors_ = {};
  for (int k = 0; k < kCellColors; ++k) {
    for (int c = 0; c < 3; ++c) colors_[k][c] = appearance.inks[k][c] - appearance.black[c];
  }
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      labels_[static_cast<size_t>(row + 2) * (board.cols + 4) + col + 2] =
          static_cast<uint8_t>(board.at(row, col));
    }
  }
}

CellFitter::Level CellFitter::LevelFor(const CellPose& pose) const {
  const int level = PyramidLevelFor(pose.ShorterEdge(), pyramid_.size());
  const ColorImage& image = pyramid_[level];
  return {{image.rgbx.data(), image.width_px, image.height_px}, static_cast<float>(1 << level)};
}

CellPrint CellFitter::PrintAt(int row, int col, const CellPose& pose, float scale,
                              const NeighborWeights& weights) const {
  CellPrint print;
  for (int i = 0; i < 5; ++i) {
    const uint8_t* labels = &labels_[static_cast<size_t>(row + i) * (board_.cols + 4) + col];
    for (int j = 0; j < 5; ++j) std::copy_n(colors_[labels[j]].data(), 4, print.colors[i][j]);
  }
  std::copy(appearance_.black.begin(), appearance_.black.end(), print.black);
  std::copy(weights.begin(), weights.end(), print.neighbor_weights);
  const float sigma = SigmaInPyramid(appearance_.sigma_px, scale) / pose.Area();
  print.along_u = &profile_.AlongU(sigma * Length(pose.bx, pose.by));
  print.along_v = &profile_.AlongV(sigma * Length(pose.ax, pose.ay));
  return print;
}

CellFit CellFitter::Fit(const PredictedCell& expected, const FitLimits& limits,
                        const SampleMask* visible) const {
  const CellPose& start = expected.pose;
  CellFit fit;
  fit.pose = start;
  const float area = start.Area();
  if (!(area > kLeastAreaPx2) || area > kMostAreaPx2) return fit;
  const auto [image, scale] = LevelFor(start);
  const CellPrint print = PrintAt(expected.row, expected.col, start, scale, expected.in_sight);
  Window window(kernels_, image, print, visible);
  CellPose pose = start.InHalvings(scale);
  StepEquations equations;
  int prepared_for = 0;  // rendering
  SmallVector<6> total = {};
  for (int iteration = 0; iteration < limits.iterations; ++iteration) {
    if (!window.Evaluate(pose, {}, &fit)) return fit;
    if (std::exchange(prepared_for, window.renderings) != window.renderings)
      equations.Prepare(window.model.sums, window.light);
    SmallCholesky<6> solver;
    if (!solver.Factor(equations.Normal(fit.gain, prior_))) return fit;
    SmallVector<6> residual = equations.Residual(window.sums, window.light, fit.gain);
    for (int p = 0; p < 6; ++p) residual[p] -= prior_[p] * total[p];
    SmallVector<6> step = solver.Solve(residual);
    fit.predicted = fit.explained + Dot(step, residual) / window.light.variance;
    const float above =
        limits.iterations == 1 ? kAbovePredictionOfOne : kAbovePrediction[std::min(iteration, 2)];
    if (fit.predicted < limits.min_explained - above) return fit;
    const float length = Length(step[0], step[3]);
    const float shortened = length > kLongestStep ? kLongestStep / length : 1;
    for (int p = 0; p < 6; ++p) {
      step[p] *= shortened;
      total[p] += step[p];
    }
    pose = Moved(pose, step);
    fit.pose = pose.InHalvings(1 / scale);
    fit.moved_cells = Length(total[0], total[3]);
    if (!(fit.moved_cells < 1)) return fit;
    if (iteration + 1 == limits.iterations || length < kShortestStep) {
      const SmallVector<6> along_u = solver.Forward({1, 0, 0, 0, 0, 0}),
                           along_v = solver.Forward({0, 0, 0, 1, 0, 0});
      const float variance = 0.5f * (Dot(along_u, along_u) + Dot(along_v, along_v));
      fit.sigma_px = fit.noise * std::sqrt(std::max(fit.pose.Area(), 0.0f) * variance);
      if (length >= kShortestStep && !window.Evaluate(pose, {}, &fit)) return fit;
      break;
    }
  }
  ScoreInk(colors_, static_cast<int>(board_.at(expected.row, expected.col)), window.model.sums, window.sums,
           &fit);
  fit.converged = true;
  return fit;
}

CellFit CellFitter::FitCenter(int row, int col, const NineCenters& centers, const NeighborWeights& weights,
                              CenterNormal* normal) const {
  CellFit fit;
  CellWarp warp;
  Interpolate(centers, &fit.pose, &warp);
  CellPose& f = fit.pose;
  const float area = f.Area();
  if (!(area > kLeastAreaPx2) || area > kMostAreaPx2) return fit;
  const auto [image, scale] = LevelFor(f);
  CellPrint print = PrintAt(row, col, f, scale, weights);
  print.moves_center = true;
  Window window(kernels_, image, print);
  if (!window.Evaluate(f.InHalvings(scale), warp.InHalvings(scale), &fit)) return fit;
  fit.converged = true;
  if (normal == nullptr) return fit;
  ScoreInk(colors_, static_cast<int>(board_.at(row, col)), window.model.sums, window.sums, &fit);
  float gain = fit.gain;
  if (std::any_of(weights.begin(), weights.end(), [](float weight) { return weight < 1; })) {
    CellFit trusting;
    fit.converged = window.TrustPrint(&trusting);
    if (!fit.converged) return fit;
    gain = trusting.gain;
  }
  *normal = CenterEquations(window.model.sums, window.sums, window.light, gain).InPx(f, noise());
  return fit;
}

}  // namespace weft
