#include "pattern/cell_fitter.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

namespace weft {
namespace {

using Vector6 = Eigen::Matrix<float, 6, 1>;
using Vector4 = Eigen::Matrix<float, 4, 1>;
using Matrix4 = Eigen::Matrix<float, 4, 4>;
using Matrix6 = Eigen::Matrix<float, 6, 6>;

// Grey levels by which the model is typically wrong; balances the priors.
constexpr float kModelNoise = 8.0f;
constexpr float kPositionPrior = 0.35f;  // cells
constexpr float kShapePrior = 0.12f;     // per cell
constexpr float kOffsetPrior = 12.0f;    // grey levels
constexpr float kSlopePrior = 0.3f;      // of the gain, per cell
constexpr float kLongestStep = 0.3f;     // cells
constexpr float kShortestStep = 0.02f;   // cells; a shorter one ends the iterations
constexpr float kLeastAreaPx2 = 1.0f, kMostAreaPx2 = 4000.0f;

// Index of the product of monomials p and q (of 1, u, v) among 1, u, v, uu, uv, vv.
constexpr int kProduct[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

float SumOf(const float* v) { return v[0] + v[1] + v[2]; }

// Light of a window by least squares: gain times (1 + slopes along u and v), and an offset; with priors on
// the slopes and the offset.
struct Light {
  Matrix4 normal;
  Vector4 solved;  // gain, its changes along u and v, offset
  Eigen::LLT<Matrix4> solver;

  // False where the print cannot be there.
  bool Solve(const CellModelSums& s, const CellImageSums& image, CellFit* fit) {
    constexpr float kOffset = 0.1f * (kModelNoise * kModelNoise) / (kOffsetPrior * kOffsetPrior);
    constexpr float kSlope = 0.1f / (kSlopePrior * kSlopePrior);
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) normal(p, q) = s.tt[kProduct[p][q]];
      normal(p, 3) = normal(3, p) = s.t1[p];
    }
    normal(3, 3) = 3 * s.weight;
    const Vector4 target{image.ti[0], image.ti[1], image.ti[2], SumOf(image.i1)};
    Matrix4 with_prior = normal;
    with_prior(1, 1) += kSlope * s.tt[0];
    with_prior(2, 2) += kSlope * s.tt[0];
    with_prior(3, 3) *= 1 + kOffset;
    solver.compute(with_prior);
    if (solver.info() != Eigen::Success) return false;
    solved = solver.solve(target);
    fit->gain = solved[0];
    fit->offset = solved[3];
    const float sse = image.ii - 2 * solved.dot(target) + solved.dot(normal * solved);
    float variance = image.ii;
    for (const float channel : image.i1) variance -= channel * channel / s.weight;
    fit->explained = 1 - sse / std::max(variance, 1.0f);
    fit->noise = std::sqrt(std::max(sse, 0.0f) / (3 * s.weight));
    return fit->gain > 0;
  }
};

// Normal equations of the step over (1, u, v) in u and in v, the light projected out.
std::pair<Matrix6, Vector6> StepEquations(const CellModelSums& s, const CellImageSums& image,
                                          const Light& light, const CellFit& fit) {
  Matrix6 normal;
  Vector6 with_i;
  Eigen::Matrix<float, 6, 4> with_light;
  for (int p = 0; p < 3; ++p) {
    for (int q = 0; q < 3; ++q) {
      const int k = kProduct[p][q];
      normal(p, q) = s.uu[k];
      normal(p, 3 + q) = normal(3 + q, p) = s.uv[k];
      normal(3 + p, 3 + q) = s.vv[k];
      with_light(p, q) = s.ut[k];
      with_light(3 + p, q) = s.vt[k];
    }
    with_light(p, 3) = s.u1[p];
    with_light(3 + p, 3) = s.v1[p];
    with_i[p] = image.ui[p];
    with_i[3 + p] = image.vi[p];
  }
  const float gain = fit.gain;
  const Vector6 residual = gain * (with_i - with_light * light.solved);
  normal -= with_light * light.solver.solve(with_light.transpose());
  return {gain * gain * normal, residual};
}

// The frame after the map (u, v) -> (u, v) + step over (1, u, v).
CellFrame Moved(const CellFrame& frame, const Vector6& step) {
  Eigen::Matrix2f change, edges;
  change << 1 + step[1], step[2], step[4], 1 + step[5];
  edges << frame.ax, frame.bx, frame.ay, frame.by;
  edges = edges * change.inverse();
  const Eigen::Vector2f shift = edges * Eigen::Vector2f(step[0], step[3]);
  return {frame.x - shift[0], frame.y - shift[1], edges(0, 0), edges(1, 0), edges(0, 1), edges(1, 1)};
}

// Compares the expected ink with the others on the cell itself.
void JudgeInk(const std::array<std::array<float, 4>, kCellColors + 1>& colors, int expected,
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

// Whether the samples of a cell are in the image: all, some or none.
enum class Inside { kAll, kSome, kNone };
Inside WhereIs(const CellFrame& f, const CellCurvature& bend, int width_px, int height_px) {
  constexpr float kReach = 0.875f;
  const float bend_x = 0.5f * (std::abs(bend.uu_x) + std::abs(bend.vv_x)) + std::abs(bend.uv_x);
  const float bend_y = 0.5f * (std::abs(bend.uu_y) + std::abs(bend.vv_y)) + std::abs(bend.uv_y);
  const float half_x = kReach * (std::abs(f.ax) + std::abs(f.bx) + bend_x);
  const float half_y = kReach * (std::abs(f.ay) + std::abs(f.by) + bend_y);
  const float x_last = static_cast<float>(width_px - 1), y_last = static_cast<float>(height_px - 1);
  if (f.x >= half_x && f.x <= x_last - half_x && f.y >= half_y && f.y <= y_last - half_y) return Inside::kAll;
  const bool some =
      f.x + half_x >= 0 && f.x - half_x <= x_last && f.y + half_y >= 0 && f.y - half_y <= y_last;
  return some ? Inside::kSome : Inside::kNone;
}

// 1 for samples in the image, 0 for others; returns how many are.
int MaskOutside(const CellFrame& f, const CellCurvature& bend, int width_px, int height_px, float* mask) {
  const float x_last = static_cast<float>(width_px - 1), y_last = static_cast<float>(height_px - 1);
  int inside = 0;
  for (int k = 0; k < kSampleGroups * kSampleLanes; ++k) {
    const float u = CellSample(k % kCellSide), v = CellSample(k / kCellSide);
    const float x =
        f.x + u * f.ax + v * f.bx + 0.5f * (u * u * bend.uu_x + v * v * bend.vv_x) + u * v * bend.uv_x;
    const float y =
        f.y + u * f.ay + v * f.by + 0.5f * (u * u * bend.uu_y + v * v * bend.vv_y) + u * v * bend.uv_y;
    const bool in = x >= 0 && y >= 0 && x <= x_last && y <= y_last;
    mask[k] = in ? 1.0f : 0.0f;
    inside += in;
  }
  return inside;
}

}  // namespace

CellFitter::CellFitter(const std::vector<ColorImage>& pyramid, const Board& board,
                       const SampledProfile& profile, const Appearance& appearance)
    : pyramid_(pyramid),
      board_(board),
      profile_(profile),
      appearance_(appearance),
      kernels_(BestCellKernels()) {
  colors_ = {};
  for (int k = 0; k < kCellColors; ++k) {
    for (int c = 0; c < 3; ++c) colors_[k][c] = appearance.inks[k][c] - appearance.black[c];
  }
}

void CellFitter::SetLook(int row, int col, const NeighborWeights& weights, CellLook* look) const {
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      const int r = row + i - 2, c = col + j - 2;
      const int label = board_.Contains(r, c) ? static_cast<int>(board_.at(r, c)) : kCellColors;
      std::copy(colors_[label].begin(), colors_[label].end(), look->colors[i][j]);
    }
  }
  std::copy(appearance_.black.begin(), appearance_.black.end(), look->black);
  std::copy(weights.begin(), weights.end(), look->neighbor_weights);
}

CellFit CellFitter::Fit(int row, int col, const CellFrame& start, const NeighborWeights& weights,
                        const CellFitOptions& options) const {
  constexpr float kPosition = kModelNoise * kModelNoise / (kPositionPrior * kPositionPrior);
  constexpr float kShape = kModelNoise * kModelNoise / (kShapePrior * kShapePrior);
  constexpr int kLeastSamples = 12;
  static const Vector6 kPrior{kPosition, kShape, kShape, kPosition, kShape, kShape};
  CellFit fit;
  fit.frame = start;
  const float area = start.Area();
  if (!(area > kLeastAreaPx2) || area > kMostAreaPx2) return fit;
  const int level = PyramidLevelFor(start.ShorterEdge(), pyramid_.size());
  const float scale = static_cast<float>(1 << level);
  const ColorImage& image = pyramid_[level];
  const PixelView view{image.rgbx.data(), image.width_px, image.height_px};

  CellLook look;
  SetLook(row, col, weights, &look);
  const float sigma_px = SigmaInPyramid(appearance_.sigma_px, scale);
  look.along_u = &profile_.AlongU(sigma_px * std::hypot(start.bx, start.by) / area);
  look.along_v = &profile_.AlongV(sigma_px * std::hypot(start.ax, start.ay) / area);
  const CellCurvature& c = options.curvature;
  const CellCurvature bend{c.uu_x / scale, c.uu_y / scale, c.uv_x / scale,
                           c.uv_y / scale, c.vv_x / scale, c.vv_y / scale};
  CellModel model;
  CellSamples samples;
  CellImageSums sums;
  Light light;
  bool rendered = false;
  CellFrame frame = start.InHalvings(scale);
  // The light at the frame; false where the print cannot be there.
  const auto look_again = [&] {
    const Inside inside = WhereIs(frame, bend, view.width_px, view.height_px);
    if (inside == Inside::kNone) return false;
    if (inside == Inside::kSome) {
      alignas(64) float mask[kSampleGroups * kSampleLanes];
      if (MaskOutside(frame, bend, view.width_px, view.height_px, mask) < kLeastSamples) return false;
      kernels_.render(look, mask, &model);
      rendered = false;
      if (!(model.sums.shape > 0)) return false;
    } else if (!rendered) {
      kernels_.render(look, nullptr, &model);
      rendered = true;
    }
    kernels_.sample(view, frame, bend, &samples);
    kernels_.sum(model, samples, &sums);
    return light.Solve(model.sums, sums, &fit);
  };
  Vector6 total = Vector6::Zero();
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    if (!look_again()) return fit;
    auto [normal, residual] = StepEquations(model.sums, sums, light, fit);
    normal.diagonal() += kPrior;
    const Eigen::LLT<Matrix6> solver(normal);
    if (solver.info() != Eigen::Success) return fit;
    Vector6 step = solver.solve(residual - kPrior.cwiseProduct(total));
    const float length = std::hypot(step[0], step[3]);
    if (length > kLongestStep) step *= kLongestStep / length;
    total += step;
    frame = Moved(frame, step);
    fit.frame = frame.InHalvings(1 / scale);
    fit.moved_cells = std::hypot(total[0], total[3]);
    if (!(fit.moved_cells < 1)) return fit;
    if (iteration + 1 == options.iterations || length < kShortestStep) {
      const Matrix6 covariance = solver.solve(Matrix6::Identity());
      const float pitch_px = std::sqrt(std::max(fit.frame.Area(), 0.0f));
      fit.sigma_px = fit.noise * pitch_px * std::sqrt(0.5f * (covariance(0, 0) + covariance(3, 3)));
      if (length >= kShortestStep && !look_again()) return fit;
      break;
    }
  }
  const bool on_board = board_.Contains(row, col);
  JudgeInk(colors_, on_board ? static_cast<int>(board_.at(row, col)) : kCellColors, model.sums, sums, &fit);
  fit.converged = true;
  return fit;
}

}  // namespace weft
