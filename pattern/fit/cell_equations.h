// Normal equations of a cell in an image, from the sums of the kernels: its light, a step of its pose, and a
// move of its centre.
#pragma once

#include <algorithm>
#include <cmath>

#include "pattern/fit/cell_fitter.h"
#include "pattern/fit/cell_kernel.h"
#include "pattern/fit/small_cholesky.h"

namespace weft {

// Index of the product of monomials p and q (of 1, u, v) among 1, u, v, uu, uv, vv.
inline constexpr int kMonomialProduct[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

// Light of a window by least squares: gain times (1 + slopes along u and v), and an offset; with priors on
// the slopes and the offset.
struct WindowLight {
  SmallVector<4> solved;  // gain, its changes along u and v, offset
  SmallMatrix<4> normal;
  SmallCholesky<4> solver;
  float variance = 1;  // of the image in the window, weighted

  // What does not depend on the image; false where the print cannot be seen.
  bool Prepare(const CellModelSums& s) {
    constexpr float kOffsetPrior = 12.0f;  // grey levels
    constexpr float kSlopePrior = 0.3f;    // of the gain, per cell
    constexpr float kOffset = 0.1f * (kModelNoise * kModelNoise) / (kOffsetPrior * kOffsetPrior);
    constexpr float kSlope = 0.1f / (kSlopePrior * kSlopePrior);
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) normal[p][q] = s.tt[kMonomialProduct[p][q]];
      normal[p][3] = normal[3][p] = s.t1[p];
    }
    normal[3][3] = 3 * s.weight;
    SmallMatrix<4> with_prior = normal;
    with_prior[1][1] += kSlope * s.tt[0];
    with_prior[2][2] += kSlope * s.tt[0];
    with_prior[3][3] *= 1 + kOffset;
    return solver.Factor(with_prior);
  }

  // False where the print cannot be there.
  bool Solve(const CellModelSums& s, const CellImageSums& image, CellFit* fit) {
    const SmallVector<4> target{image.ti[0], image.ti[1], image.ti[2],
                                image.i1[0] + image.i1[1] + image.i1[2]};
    solved = solver.Solve(target);
    fit->gain = solved[0];
    fit->offset = solved[3];
    float sse = image.ii - 2 * Dot(solved, target);
    for (int p = 0; p < 4; ++p) sse += solved[p] * Dot(normal[p], solved);
    variance = image.ii;
    for (const float channel : image.i1) variance -= channel * channel / s.weight;
    variance = std::max(variance, 1.0f);
    fit->explained = 1 - sse / variance;
    fit->noise = std::sqrt(std::max(sse, 0.0f) / (3 * s.weight));
    return fit->gain > 0;
  }
};

// Normal equations of the step over (1, u, v) in u and in v, the light projected out; not of the image.
class StepEquations {
 public:
  void Prepare(const CellModelSums& s, const WindowLight& light) {
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) {
        const int k = kMonomialProduct[p][q];
        normal_[p][q] = s.uu[k];
        normal_[3 + p][q] = s.uv[k];
        normal_[3 + p][3 + q] = s.vv[k];
      }
      const int* k = kMonomialProduct[p];
      with_light_[p] = {s.ut[k[0]], s.ut[k[1]], s.ut[k[2]], s.u1[p]};
      with_light_[3 + p] = {s.vt[k[0]], s.vt[k[1]], s.vt[k[2]], s.v1[p]};
    }
    SmallVector<4> whitened[6];
    for (int p = 0; p < 6; ++p) whitened[p] = light.solver.Forward(with_light_[p]);
    for (int p = 0; p < 6; ++p) {
      for (int q = 0; q <= p; ++q) normal_[p][q] -= Dot(whitened[p], whitened[q]);
    }
  }

  // Lower triangle, with a prior on the diagonal.
  SmallMatrix<6> Normal(float gain, const SmallVector<6>& prior) const {
    SmallMatrix<6> normal;
    for (int p = 0; p < 6; ++p) {
      for (int q = 0; q <= p; ++q) normal[p][q] = gain * gain * normal_[p][q];
      normal[p][p] += prior[p];
    }
    return normal;
  }

  SmallVector<6> Residual(const CellImageSums& image, const WindowLight& light, float gain) const {
    SmallVector<6> residual;
    for (int p = 0; p < 3; ++p) {
      residual[p] = gain * (image.ui[p] - Dot(with_light_[p], light.solved));
      residual[3 + p] = gain * (image.vi[p] - Dot(with_light_[3 + p], light.solved));
    }
    return residual;
  }

 private:
  SmallMatrix<6> normal_;         // for a gain of 1
  SmallVector<4> with_light_[6];  // products with what the light is made of
};

// The same for a move of the centre alone, over 1 in u and in v.
struct CenterEquations {
  float uu, uv, vv;
  float u, v;  // residuals

  CenterEquations(const CellModelSums& s, const CellImageSums& image, const WindowLight& light, float gain) {
    constexpr float kLeastPrecision = 1e-3f;  // keeps a step without evidence small
    const SmallVector<4> ut{s.ut[0], s.ut[1], s.ut[2], s.u1[0]}, vt{s.vt[0], s.vt[1], s.vt[2], s.v1[0]};
    const SmallVector<4> whitened_u = light.solver.Forward(ut), whitened_v = light.solver.Forward(vt);
    u = gain * (image.ui[0] - Dot(ut, light.solved));
    v = gain * (image.vi[0] - Dot(vt, light.solved));
    uu = gain * gain * (s.uu[0] - Dot(whitened_u, whitened_u)) + kLeastPrecision;
    uv = gain * gain * (s.uv[0] - Dot(whitened_v, whitened_u));
    vv = gain * gain * (s.vv[0] - Dot(whitened_v, whitened_v)) + kLeastPrecision;
  }

  // Over moves in px, against which the print moves in the cell's coordinates. `noise` in grey levels.
  CenterNormal InPx(const CellPose& f, float noise) const {
    const float precision = 1 / (noise * noise);
    const float inverse = 1 / f.Area();
    const float ux = -inverse * f.by, uy = inverse * f.bx, vx = inverse * f.ay, vy = -inverse * f.ax;
    CenterNormal normal;
    normal.xx = precision * (uu * ux * ux + 2 * uv * ux * vx + vv * vx * vx);
    normal.xy = precision * (uu * ux * uy + uv * (ux * vy + uy * vx) + vv * vx * vy);
    normal.yy = precision * (uu * uy * uy + 2 * uv * uy * vy + vv * vy * vy);
    normal.x = -precision * (u * ux + v * vx);
    normal.y = -precision * (u * uy + v * vy);
    return normal;
  }
};

}  // namespace weft
