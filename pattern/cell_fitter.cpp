#include "pattern/cell_fitter.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "pattern/cell_window.h"

namespace weft {
namespace {

using Vector6 = Eigen::Matrix<float, 6, 1>;
using Matrix6 = Eigen::Matrix<float, 6, 6>;

// Grey levels by which the model is typically wrong; balances the priors.
constexpr float kModelNoise = 8.0f;
constexpr float kPositionPrior = 0.35f;  // cells
constexpr float kShapePrior = 0.12f;     // per cell
constexpr float kOffsetPrior = 12.0f;    // grey levels
constexpr float kLongestStep = 0.3f;     // cells
constexpr float kShortestStep = 0.02f;   // cells; a shorter one ends the iterations
constexpr float kLeastPixels = 8;

// Index of the product of monomials p and q (of 1, u, v) among 1, u, v, uu, uv, vv.
constexpr int kProduct[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

// Weighted sums over pixels: t is the model, tu and tv its derivatives, i the image.
struct Sums {
  float weight = 0;
  float pixels = 0;
  // Over channels: products of the model's derivatives with monomials 1, u, v, uu, uv, vv.
  Float4 uu[6] = {}, uv[6] = {}, vv[6] = {};
  Float4 ut[3] = {}, vt[3] = {}, u1[3] = {}, v1[3] = {}, ui[3] = {}, vi[3] = {};
  Float4 tt = {}, t1 = {}, ti = {}, i1 = {}, ii = {};

  void Add(Float4 image, Float4 t, Float4 tu, Float4 tv, float u, float v, float w) {
    weight += w;
    pixels += 1;
    const Float4 wt = t * w, wi = image * w, wtu = tu * w, wtv = tv * w;
    tt += wt * t;
    t1 += wt;
    ti += wt * image;
    i1 += wi;
    ii += wi * image;
    const float m[6] = {1, u, v, u * u, u * v, v * v};
    const Float4 products[3] = {wtu * tu, wtu * tv, wtv * tv};
    for (int k = 0; k < 6; ++k) {
      uu[k] += products[0] * m[k];
      uv[k] += products[1] * m[k];
      vv[k] += products[2] * m[k];
    }
    const Float4 mixed[4] = {wtu * t, wtv * t, wtu * image, wtv * image};
    for (int k = 0; k < 3; ++k) {
      ut[k] += mixed[0] * m[k];
      vt[k] += mixed[1] * m[k];
      u1[k] += wtu * m[k];
      v1[k] += wtv * m[k];
      ui[k] += mixed[2] * m[k];
      vi[k] += mixed[3] * m[k];
    }
  }
};

Sums Accumulate(const ColorImage& image, const CellWindow& w, const NeighborWeights& weights, int stride) {
  Sums sums;
  const float fall = 1 / (w.reach * w.reach);
  w.ForEachPixel(image, stride, [&](const uint8_t* pixel, float u, float v) {
    const int j = std::clamp(static_cast<int>(u + 2.5f), 1, 3),
              i = std::clamp(static_cast<int>(v + 2.5f), 1, 3);
    const auto& pu = w.along_u[BlurredProfile::Bin(u - static_cast<float>(j - 2))];
    const auto& pv = w.along_v[BlurredProfile::Bin(v - static_cast<float>(i - 2))];
    Float4 rows[3], slopes[3];
    for (int k = 0; k < 3; ++k) {
      const Float4* c = &w.colors[i - 1 + k][j - 1];
      rows[k] = c[0] * pu.before + c[1] * pu.here + c[2] * pu.after;
      slopes[k] = c[0] * pu.slope_before + c[1] * pu.slope_here + c[2] * pu.slope_after;
    }
    const Float4 t = w.black + rows[0] * pv.before + rows[1] * pv.here + rows[2] * pv.after;
    const Float4 tu = slopes[0] * pv.before + slopes[1] * pv.here + slopes[2] * pv.after;
    const Float4 tv = rows[0] * pv.slope_before + rows[1] * pv.slope_here + rows[2] * pv.slope_after;
    const float weight = weights[3 * (i - 1) + j - 1] * (1 - u * u * fall) * (1 - v * v * fall);
    sums.Add(LoadPixel(pixel), t, tu, tv, u, v, weight);
  });
  return sums;
}

// Light of a window by least squares, with a prior on the offset; false where the print cannot be there.
struct Light {
  float tt, t1, n1, det;  // normal equations of gain and offset

  bool Solve(const Sums& s, CellFit* fit) {
    constexpr float kPrior = 0.1f * (kModelNoise * kModelNoise) / (kOffsetPrior * kOffsetPrior);
    tt = SumOf(s.tt);
    t1 = SumOf(s.t1);
    n1 = 3 * s.weight * (1 + kPrior);
    det = tt * n1 - t1 * t1;
    if (!(det > 0)) return false;
    const float ti = SumOf(s.ti), i1 = SumOf(s.i1), ii = SumOf(s.ii);
    fit->gain = (ti * n1 - i1 * t1) / det;
    fit->offset = (i1 * tt - ti * t1) / det;
    const float sse = ii - 2 * fit->gain * ti - 2 * fit->offset * i1 + fit->gain * fit->gain * tt +
                      2 * fit->gain * fit->offset * t1 + fit->offset * fit->offset * 3 * s.weight;
    float variance = ii;
    for (int c = 0; c < 3; ++c) variance -= s.i1[c] * s.i1[c] / s.weight;
    fit->explained = 1 - sse / std::max(variance, 1.0f);
    fit->noise = std::sqrt(std::max(sse, 0.0f) / (3 * s.weight));
    return fit->gain > 0;
  }
};

// Normal equations of the step over (1, u, v) in u and in v, gain and offset projected out.
std::pair<Matrix6, Vector6> StepEquations(const Sums& s, const Light& light, const CellFit& fit) {
  Matrix6 normal;
  Vector6 with_t, with_1, with_i;
  for (int p = 0; p < 3; ++p) {
    for (int q = 0; q < 3; ++q) {
      const int k = kProduct[p][q];
      normal(p, q) = SumOf(s.uu[k]);
      normal(p, 3 + q) = normal(3 + q, p) = SumOf(s.uv[k]);
      normal(3 + p, 3 + q) = SumOf(s.vv[k]);
    }
    with_t[p] = SumOf(s.ut[p]);
    with_t[3 + p] = SumOf(s.vt[p]);
    with_1[p] = SumOf(s.u1[p]);
    with_1[3 + p] = SumOf(s.v1[p]);
    with_i[p] = SumOf(s.ui[p]);
    with_i[3 + p] = SumOf(s.vi[p]);
  }
  const float gain = fit.gain;
  const Vector6 residual = gain * (with_i - gain * with_t - fit.offset * with_1);
  const Vector6 on_t = (with_t * light.n1 - with_1 * light.t1) / light.det;
  const Vector6 on_1 = (with_1 * light.tt - with_t * light.t1) / light.det;
  normal -= with_t * on_t.transpose() + with_1 * on_1.transpose();
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

// Compares the expected ink with the others on the cell itself. False without pixels.
bool JudgeInk(const ColorImage& image, const Appearance& appearance, const CellWindow& w, int stride,
              CellFit* fit) {
  Float4 with_shape = {};
  float shape2 = 0, pixels = 0;
  w.ForEachPixel(image, stride, [&](const uint8_t* pixel, float u, float v) {
    const auto& pu = w.along_u[BlurredProfile::Bin(u)];
    const auto& pv = w.along_v[BlurredProfile::Bin(v)];
    const float along_v[3] = {pv.before, pv.here, pv.after};
    Float4 t = w.black;
    for (int i = 0; i < 3; ++i) {
      const Float4* c = &w.colors[i + 1][1];
      t += (c[0] * pu.before + c[1] * pu.here + c[2] * pu.after) * along_v[i];
    }
    const float shape = pu.here * pv.here;
    with_shape += (LoadPixel(pixel) - (t * fit->gain + Splat(fit->offset))) * shape;
    shape2 += shape * shape;
    pixels += 1;
  });
  if (pixels < 1) return false;
  const int expected = w.labels[2][2];
  const Float4 own = FromRgb(appearance.inks[expected]);
  float lead = 1e9f, contrast = 1e9f;
  for (int k = 0; k < kCellColors; ++k) {
    if (k == expected) continue;
    const Float4 change = (FromRgb(appearance.inks[k]) - own) * fit->gain;
    const float squared = shape2 * SumOf(change * change);
    lead = std::min(lead, (squared - 2 * SumOf(change * with_shape)) / (3 * pixels));
    contrast = std::min(contrast, squared / (3 * pixels));
  }
  fit->ink_lead = lead;
  fit->center_contrast = std::sqrt(contrast);
  return true;
}

}  // namespace

CellFit CellFitter::Fit(int row, int col, const CellFrame& start, const NeighborWeights& weights,
                        const CellFitOptions& options) const {
  CellFit fit;
  fit.frame = start;
  CellWindow window;
  window.SetColors(board_, appearance_, row, col);
  constexpr float kPosition = kModelNoise * kModelNoise / (kPositionPrior * kPositionPrior);
  constexpr float kShape = kModelNoise * kModelNoise / (kShapePrior * kShapePrior);
  const Vector6 prior{kPosition, kShape, kShape, kPosition, kShape, kShape};
  Vector6 total = Vector6::Zero();
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    if (!window.Place(fit.frame, options.curvature, options.reach, image_, profile_, appearance_.sigma_px))
      return fit;
    const Sums sums = Accumulate(image_, window, weights, options.stride);
    Light light;
    if (sums.pixels < kLeastPixels || !(sums.weight > 0) || !light.Solve(sums, &fit)) return fit;
    auto [normal, residual] = StepEquations(sums, light, fit);
    normal.diagonal() += prior;
    const Eigen::LLT<Matrix6> solver(normal);
    if (solver.info() != Eigen::Success) return fit;
    Vector6 step = solver.solve(residual - prior.cwiseProduct(total));
    const float length = std::hypot(step[0], step[3]);
    if (length > kLongestStep) step *= kLongestStep / length;
    total += step;
    fit.frame = Moved(fit.frame, step);
    fit.moved_cells = std::hypot(total[0], total[3]);
    if (!(fit.moved_cells < 1)) return fit;
    if (iteration + 1 == options.iterations || length < kShortestStep) {
      const Matrix6 covariance = solver.solve(Matrix6::Identity());
      const float pitch_px = std::sqrt(std::max(fit.frame.Area(), 0.0f));
      fit.sigma_px = fit.noise * pitch_px * std::sqrt(0.5f * (covariance(0, 0) + covariance(3, 3)));
      break;
    }
  }
  fit.converged = window.Place(fit.frame, options.curvature, 0.5f, image_, profile_, appearance_.sigma_px) &&
                  JudgeInk(image_, appearance_, window, options.stride, &fit);
  return fit;
}

}  // namespace weft
