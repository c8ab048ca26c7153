#include "pattern/fit/appearance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "pattern/fit/cell_kernel.h"

namespace weft {
namespace {

constexpr int kUnknowns = kCellColors + 1;  // the inks and black
constexpr int kRounds = 3;
using MatrixN = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using MatrixN3 = Eigen::Matrix<double, kUnknowns, 3>;

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

// A cell with its samples of the image.
struct SampledCell {
  CellInks inks;
  CellPose pose;
  float scale;  // of the image that was sampled
  CellSamples samples;
};

// The place in the 3x3 neighbourhood that a sample lies on.
int NeighborOf(int sample) {
  const auto side = [](float x) { return x < -0.5f ? 0 : (x > 0.5f ? 2 : 1); };
  return 3 * side(CellSample(sample / kCellSide)) + side(CellSample(sample % kCellSide));
}

std::vector<SampledCell> SampleCells(const PrintedView& view, const std::vector<PredictedCell>& cells) {
  std::vector<SampledCell> sampled;
  sampled.reserve(cells.size());
  for (const PredictedCell& cell : cells) {
    const int level = PyramidLevelFor(cell.pose.ShorterEdge(), view.pyramid.size());
    const ColorImage& image = view.pyramid[level];
    SampledCell out;
    out.scale = static_cast<float>(1 << level);
    out.pose = cell.pose;
    const CellPose& f = cell.pose;
    if (!(f.Area() > 1)) continue;
    for (int k = 0; k < 25; ++k) {
      const int r = cell.row + k / 5 - 2, c = cell.col + k % 5 - 2;
      out.inks.inks[k / 5][k % 5] =
          view.board.Contains(r, c) ? static_cast<int>(view.board.at(r, c)) : kCellColors;
    }
    for (int k = 0; k < kCellSide * kCellSide; ++k) out.inks.weights[k] = cell.in_sight[NeighborOf(k)];
    BestCellKernels().sample({image.rgbx.data(), image.width_px, image.height_px}, f.InHalvings(out.scale),
                             {}, &out.samples);
    sampled.push_back(out);
  }
  return sampled;
}

// What one cell's samples say about the colours at light 1.
ColorSums SumCell(const CellInks& inks, const CellSamples& samples) {
  CellColorSums of_cell;
  BestCellKernels().colors(inks, samples, &of_cell);
  ColorSums sums;
  sums.normal = Eigen::Map<const MatrixN>(of_cell.normal[0]).triangularView<Eigen::Lower>();
  sums.normal.triangularView<Eigen::StrictlyUpper>() = sums.normal.transpose();
  sums.target = Eigen::Map<const MatrixN3>(of_cell.target[0]);
  sums.square = of_cell.square;
  return sums;
}

// The ratio between the samples and what the appearance predicts at light 1; not positive where the samples
// are dark.
double LightOf(const ColorSums& sums, const Appearance& now) {
  MatrixN3 colors;
  for (int k = 0; k < kUnknowns; ++k) {
    for (int c = 0; c < 3; ++c) colors(k, c) = k < kCellColors ? now.inks[k][c] : now.black[c];
  }
  const double ti = colors.cwiseProduct(sums.target).sum();
  const double tt = colors.cwiseProduct(sums.normal * colors).sum();
  return tt > 0 ? ti / tt : 0;
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

Appearance CalibrateAppearance(const PrintedView& view, const std::vector<PlacedCell>& cells,
                               const std::vector<float>& sigmas_px, const Appearance& start) {
  std::vector<PredictedCell> in_sight;
  for (const PlacedCell& cell : cells) {
    in_sight.push_back({.row = cell.row, .col = cell.col, .pose = cell.pose});
    in_sight.back().in_sight.fill(1);
  }
  return CalibrateAppearance(view, in_sight, sigmas_px, start);
}

Appearance CalibrateAppearance(const PrintedView& view, const std::vector<PredictedCell>& cells,
                               const std::vector<float>& sigmas_px, const Appearance& start) {
  std::vector<SampledCell> sampled = SampleCells(view, cells);
  Appearance best = start;
  double least = 1e300;
  int risen = 0;
  for (const float sigma_px : sigmas_px) {
    Appearance current = start;
    current.sigma_px = sigma_px;
    std::vector<ColorSums> of_cells;
    of_cells.reserve(sampled.size());
    for (SampledCell& cell : sampled) {
      const CellPose& f = cell.pose;
      const float sigma = SigmaInPyramid(sigma_px, cell.scale) / f.Area();
      cell.inks.along_u = &view.profile.AlongU(sigma * std::hypot(f.bx, f.by));
      cell.inks.along_v = &view.profile.AlongV(sigma * std::hypot(f.ax, f.ay));
      of_cells.push_back(SumCell(cell.inks, cell.samples));
    }
    double error = 1e300;
    for (int round = 0; round < kRounds; ++round) {
      ColorSums sums;
      for (const ColorSums& cell : of_cells) {
        const double light = LightOf(cell, current);
        if (light > 0) sums.Add(cell, light);
      }
      if (sums.square > 0) error = SolveColors(sums, &current);
    }
    if (error < least) {
      least = error;
      best = current;
      risen = 0;
    } else if (++risen == 2) {
      break;
    }
  }
  return best;
}

}  // namespace weft
