#include "pattern/appearance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "pattern/cell_window.h"

namespace weft {
namespace {

constexpr int kUnknowns = kCellColors + 1;  // the inks and black
constexpr int kRounds = 3;
using MatrixN = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using MatrixN3 = Eigen::Matrix<double, kUnknowns, 3>;
using VectorN = Eigen::Matrix<double, kUnknowns, 1>;

// Least squares for the colours, given the light at each cell.
struct ColorSums {
  MatrixN normal = MatrixN::Zero();
  MatrixN3 target = MatrixN3::Zero();
  double square = 0;

  // Every cell counts the same, whatever its light.
  void Add(const ColorSums& cell, double light) {
    normal += cell.normal;
    target += cell.target / light;
    square += cell.square / (light * light);
  }
};

// What one cell's pixels say; the light is the ratio between them and what `window` predicts. Nothing where
// the window is dark.
struct CellSums {
  ColorSums sums;
  double light;
};

std::optional<CellSums> SumCell(const ColorImage& image, const CellWindow& window, int stride) {
  ColorSums own;
  double ti = 0, tt = 0;
  window.ForEachPixel(image, stride, [&](const uint8_t* pixel, float u, float v) {
    const int j = std::clamp(static_cast<int>(u + 2.5f), 1, 3),
              i = std::clamp(static_cast<int>(v + 2.5f), 1, 3);
    const auto& pu = window.along_u[BlurredProfile::Bin(u - static_cast<float>(j - 2))];
    const auto& pv = window.along_v[BlurredProfile::Bin(v - static_cast<float>(i - 2))];
    const float along_u[3] = {pu.before, pu.here, pu.after}, along_v[3] = {pv.before, pv.here, pv.after};
    VectorN mix = VectorN::Zero();
    double covered = 0;
    Float4 t = window.black;
    for (int di = 0; di < 3; ++di) {
      for (int dj = 0; dj < 3; ++dj) {
        const float share = along_u[dj] * along_v[di];
        t += window.colors[i - 1 + di][j - 1 + dj] * share;
        mix[window.labels[i - 1 + di][j - 1 + dj]] += share;
        covered += share;
      }
    }
    mix[kCellColors] += 1 - covered;
    own.normal.noalias() += mix * mix.transpose();
    for (int c = 0; c < 3; ++c) {
      own.target.col(c) += mix * static_cast<double>(pixel[c]);
      own.square += static_cast<double>(pixel[c]) * pixel[c];
      ti += static_cast<double>(t[c]) * pixel[c];
      tt += static_cast<double>(t[c]) * t[c];
    }
  });
  if (!(tt > 0) || !(ti > 0)) return std::nullopt;
  return CellSums{own, ti / tt};
}

// Solves for the colours and stores them in `appearance`; returns the unexplained share of the squares.
double SolveColors(ColorSums sums, Appearance* appearance) {
  constexpr double kPrior = 1e-3;
  Appearance& now = *appearance;
  double mean_before = 0, mean_after = 0;
  for (int k = 0; k < kUnknowns; ++k) {
    sums.normal(k, k) += kPrior;
    for (int c = 0; c < 3; ++c) {
      sums.target(k, c) += kPrior * (k < kCellColors ? now.inks[k][c] : now.black[c]);
    }
  }
  const MatrixN3 solved = sums.normal.ldlt().solve(sums.target);
  const double error = sums.square - 2 * solved.cwiseProduct(sums.target).sum() +
                       solved.cwiseProduct(sums.normal * solved).sum();
  for (int k = 0; k < kCellColors; ++k) {
    for (int c = 0; c < 3; ++c) {
      mean_before += now.inks[k][c];
      mean_after += solved(k, c);
    }
  }
  // Else the scale of light would drift.
  const double scale = mean_after > 0 ? mean_before / mean_after : 1;
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < kCellColors; ++k) now.inks[k][c] = static_cast<float>(scale * solved(k, c));
    now.black[c] = static_cast<float>(std::max(0.0, scale * solved(kCellColors, c)));
  }
  return error / std::max(sums.square, 1e-9);
}

}  // namespace

Appearance CalibrateAppearance(const ColorImage& image, const Board& board, const BlurredProfile& profile,
                               const std::vector<PlacedCell>& cells, const std::vector<float>& sigmas_px,
                               const Appearance& start) {
  Appearance best = start;
  double least = 1e300;
  for (const float sigma_px : sigmas_px) {
    Appearance current = start;
    current.sigma_px = sigma_px;
    double error = 1e300;
    for (int round = 0; round < kRounds; ++round) {
      ColorSums sums;
      for (const PlacedCell& cell : cells) {
        CellWindow window;
        window.SetColors(board, current, cell.row, cell.col);
        if (!window.Place(cell.frame, {}, 1.0f, image, profile, sigma_px)) continue;
        const int stride = std::max(1, static_cast<int>(std::sqrt(cell.frame.Area()) / 5));
        if (const auto found = SumCell(image, window, stride)) sums.Add(found->sums, found->light);
      }
      if (sums.square > 0) error = SolveColors(sums, &current);
    }
    if (error < least) {
      least = error;
      best = current;
    }
  }
  return best;
}

}  // namespace weft
