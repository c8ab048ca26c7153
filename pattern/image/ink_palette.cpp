#include "pattern/image/ink_palette.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "pattern/image/color_image.h"

namespace weft {
namespace {

constexpr int kLeastSamples = 8;
constexpr int kLightReach = 3;  // cells
// Rounding of grey levels, so that inks without noise have a scatter too.
constexpr double kRoundingVariance = 1.0 / 12;

// Mean of the pixels within the radius; empty where the disk leaves the picture.
bool DiskMean(const ColorImage& image, double x, double y, double radius, Rgb* mean) {
  const int x0 = static_cast<int>(std::ceil(x - radius)), x1 = static_cast<int>(std::floor(x + radius));
  const int y0 = static_cast<int>(std::ceil(y - radius)), y1 = static_cast<int>(std::floor(y + radius));
  if (x0 < 0 || y0 < 0 || x1 >= image.width_px || y1 >= image.height_px) return false;
  double sum[3] = {};
  int count = 0;
  for (int py = y0; py <= y1; ++py) {
    for (int px = x0; px <= x1; ++px) {
      if ((px - x) * (px - x) + (py - y) * (py - y) > radius * radius) continue;
      for (int c = 0; c < 3; ++c) sum[c] += image.at(px, py)[c];
      ++count;
    }
  }
  if (count == 0) return false;
  for (int c = 0; c < 3; ++c) (*mean)[c] = static_cast<float>(sum[c] / count);
  return true;
}

double Brightness(const Rgb& c) { return c[0] + c[1] + c[2]; }

struct Cell {
  Rgb color = {};
  CellColor ink = CellColor::kRed;
};
using Cells = std::map<std::pair<int, int>, Cell>;

std::array<Rgb, kCellColors> InkMeans(const Cells& cells,
                                      const std::map<std::pair<int, int>, double>& light) {
  std::array<std::array<double, 4>, kCellColors> sums{};
  for (const auto& [place, cell] : cells) {
    auto& sum = sums[static_cast<int>(cell.ink)];
    for (int c = 0; c < 3; ++c) sum[c] += cell.color[c] / light.at(place);
    sum[3] += 1;
  }
  std::array<Rgb, kCellColors> means{};
  for (int k = 0; k < kCellColors; ++k)
    for (int c = 0; c < 3; ++c)
      means[k][c] = static_cast<float>(sums[k][3] > 0 ? sums[k][c] / sums[k][3] : 0);
  return means;
}

// Brightness of the surroundings over what their inks have on average; the cell itself does not count.
double LightAround(const Cells& cells, int row, int col, const std::array<Rgb, kCellColors>& means) {
  double seen = 0, expected = 0;
  for (int r = row - kLightReach; r <= row + kLightReach; ++r) {
    for (int c = col - kLightReach; c <= col + kLightReach; ++c) {
      const auto cell = cells.find({r, c});
      if ((r == row && c == col) || cell == cells.end()) continue;
      seen += Brightness(cell->second.color);
      expected += Brightness(means[static_cast<int>(cell->second.ink)]);
    }
  }
  return expected > 0 && seen > 0 ? seen / expected : 0;
}

using Gaussian = std::pair<Eigen::Vector3d, Eigen::Matrix3d>;

Gaussian GaussianOf(const PaletteInk& ink) {
  Gaussian g;
  for (int i = 0; i < 3; ++i) {
    g.first[i] = ink.mean[i];
    for (int j = 0; j < 3; ++j) g.second(i, j) = ink.covariance[i][j];
  }
  return g;
}

void MeasureInks(const std::vector<PaletteSample>& samples, PaletteReport* report) {
  std::array<Eigen::Vector3d, kCellColors> sums;
  std::array<Eigen::Matrix3d, kCellColors> squares;
  sums.fill(Eigen::Vector3d::Zero());
  squares.fill(Eigen::Matrix3d::Zero());
  for (const PaletteSample& s : samples) {
    const int k = static_cast<int>(s.ink);
    const Eigen::Vector3d color(s.color[0], s.color[1], s.color[2]);
    sums[k] += color;
    squares[k] += color * color.transpose();
    ++report->inks[k].samples;
  }
  for (int k = 0; k < kCellColors; ++k) {
    PaletteInk& ink = report->inks[k];
    if (ink.samples < kLeastSamples) continue;
    const Eigen::Vector3d mean = sums[k] / ink.samples;
    const Eigen::Matrix3d covariance =
        squares[k] / ink.samples - mean * mean.transpose() + kRoundingVariance * Eigen::Matrix3d::Identity();
    for (int i = 0; i < 3; ++i) {
      ink.mean[i] = static_cast<float>(mean[i]);
      for (int j = 0; j < 3; ++j) ink.covariance[i][j] = covariance(i, j);
    }
  }
}

void MeasureSeparations(PaletteReport* report) {
  for (int a = 0; a < kCellColors; ++a) {
    for (int b = 0; b < kCellColors; ++b) {
      if (a == b || report->inks[a].samples < kLeastSamples || report->inks[b].samples < kLeastSamples)
        continue;
      const auto [mean_a, cov_a] = GaussianOf(report->inks[a]);
      const auto [mean_b, cov_b] = GaussianOf(report->inks[b]);
      const Eigen::Vector3d apart = mean_a - mean_b;
      const Eigen::Matrix3d scatter = 0.5 * (cov_a + cov_b);
      report->separation[a][b] = std::sqrt(apart.dot(scatter.ldlt().solve(apart)));
    }
  }
}

void MeasureConfusion(const std::vector<PaletteSample>& samples, PaletteReport* report) {
  struct Likelihood {
    bool known = false;
    Eigen::Vector3d mean;
    Eigen::Matrix3d precision;
    double log_norm = 0;
  };
  std::array<Likelihood, kCellColors> inks;
  for (int k = 0; k < kCellColors; ++k) {
    if (report->inks[k].samples < kLeastSamples) continue;
    const auto [mean, covariance] = GaussianOf(report->inks[k]);
    inks[k] = {true, mean, covariance.inverse(), -0.5 * std::log(covariance.determinant())};
  }
  for (const PaletteSample& s : samples) {
    const int own = static_cast<int>(s.ink);
    if (!inks[own].known) continue;
    int best = own;
    double most = -1e300;
    for (int k = 0; k < kCellColors; ++k) {
      if (!inks[k].known) continue;
      const Eigen::Vector3d d = Eigen::Vector3d(s.color[0], s.color[1], s.color[2]) - inks[k].mean;
      const double log_density = inks[k].log_norm - 0.5 * d.dot(inks[k].precision * d);
      if (log_density > most) most = log_density, best = k;
    }
    report->confusion[own][best] += 1.0 / report->inks[own].samples;
  }
}

// The least separation of an ink from all but one other.
double NextNearest(const PaletteReport& report, int ink, int but) {
  double least = 1e300;
  for (int k = 0; k < kCellColors; ++k)
    if (k != ink && k != but && report.separation[ink][k] > 0)
      least = std::min(least, report.separation[ink][k]);
  return least;
}

}  // namespace

absl::StatusOr<std::vector<PaletteSample>> SampleCells(const Frame& frame, const Board& board,
                                                       const std::vector<Observation>& observations) {
  WEFT_ASSIGN_OR_RETURN(const ColorImage image, ToColorImage(frame));
  std::map<std::pair<int, int>, const Observation*> centers;
  for (const Observation& o : observations) {
    if (o.node.kind == NodeKind::kCenter && board.Contains(o.node.row, o.node.col))
      centers[{o.node.row, o.node.col}] = &o;
  }
  Cells cells;
  for (const auto& [place, o] : centers) {
    double pitch = 1e300;
    for (const auto& [dr, dc] : {std::pair{0, 1}, {1, 0}, {0, -1}, {-1, 0}}) {
      const auto next = centers.find({place.first + dr, place.second + dc});
      if (next == centers.end()) continue;
      pitch = std::min(pitch, std::hypot(next->second->x_px - o->x_px, next->second->y_px - o->y_px));
    }
    if (pitch > 1e299) continue;
    Cell cell{.ink = board.at(place.first, place.second)};
    const double radius = std::max(0.71, 0.25 * board.square_fraction * pitch);
    if (DiskMean(image, o->x_px, o->y_px, radius, &cell.color)) cells[place] = cell;
  }
  std::map<std::pair<int, int>, double> light;
  for (const auto& [place, cell] : cells) light[place] = 1;
  // Light and inks explain each other; three rounds settle it.
  for (int round = 0; round < 3; ++round) {
    const std::array<Rgb, kCellColors> means = InkMeans(cells, light);
    double sum = 0;
    for (auto& [place, value] : light) sum += value = LightAround(cells, place.first, place.second, means);
    std::erase_if(light,
                  [&](const auto& entry) { return entry.second <= 0 && cells.erase(entry.first) > 0; });
    for (auto& [place, value] : light) value *= static_cast<double>(light.size()) / sum;
  }
  std::vector<PaletteSample> samples;
  for (const auto& [place, cell] : cells) {
    PaletteSample sample{cell.ink, cell.color};
    for (float& channel : sample.color) channel /= static_cast<float>(light.at(place));
    samples.push_back(sample);
  }
  return samples;
}

absl::StatusOr<std::vector<PaletteSample>> SampleSwatches(const Frame& frame,
                                                          const std::array<double, 2>& first_px,
                                                          const std::array<double, 2>& last_px) {
  WEFT_ASSIGN_OR_RETURN(const ColorImage image, ToColorImage(frame));
  const double dx = (last_px[0] - first_px[0]) / kCellColors, dy = (last_px[1] - first_px[1]) / kCellColors;
  const double radius = 0.25 * std::hypot(dx, dy);  // swatches of 20 mm every 24 mm
  if (!(radius >= 2))
    return absl::InvalidArgumentError(
        "the swatches are less than 8 px apart; give the middle of the red and of the "
        "black swatch of a larger picture");
  std::vector<PaletteSample> samples;
  for (int k = 0; k < kCellColors; ++k) {
    const double x = first_px[0] + k * dx, y = first_px[1] + k * dy;
    Rgb unused;
    if (!DiskMean(image, x, y, radius, &unused)) {
      return absl::InvalidArgumentError(
          absl::StrCat("the ", std::string(CellColorName(static_cast<CellColor>(k))), " swatch would lie at ",
                       std::lround(x), ", ", std::lround(y), ", off the picture of ", frame.width_px, " x ",
                       frame.height_px));
    }
    for (int py = static_cast<int>(std::ceil(y - radius)); py <= y + radius; ++py) {
      for (int px = static_cast<int>(std::ceil(x - radius)); px <= x + radius; ++px) {
        if ((px - x) * (px - x) + (py - y) * (py - y) > radius * radius) continue;
        const uint8_t* p = image.at(px, py);
        samples.push_back({static_cast<CellColor>(k),
                           {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}});
      }
    }
  }
  return samples;
}

absl::StatusOr<PaletteReport> AssessPalette(const std::vector<PaletteSample>& samples) {
  PaletteReport report;
  MeasureInks(samples, &report);
  const auto enough = [](const PaletteInk& ink) { return ink.samples >= kLeastSamples; };
  if (std::count_if(report.inks.begin(), report.inks.end(), enough) < 2) {
    return absl::FailedPreconditionError(
        absl::StrCat("only ", samples.size(), " samples of inks; at least two inks need ", kLeastSamples,
                     " each: is the print in focus, and does the board belong to it?"));
  }
  MeasureSeparations(&report);
  MeasureConfusion(samples, &report);
  double least = 1e300;
  for (int a = 0; a < kCellColors; ++a) {
    for (int b = a + 1; b < kCellColors; ++b) {
      if (report.separation[a][b] <= 0 || report.separation[a][b] >= least) continue;
      least = report.separation[a][b];
      report.weakest_a = static_cast<CellColor>(a);
      report.weakest_b = static_cast<CellColor>(b);
    }
  }
  const int a = static_cast<int>(report.weakest_a), b = static_cast<int>(report.weakest_b);
  // White is the bare cloth: only the other ink can change.
  const bool change_a =
      report.weakest_b == CellColor::kWhite ||
      (report.weakest_a != CellColor::kWhite && NextNearest(report, a, b) <= NextNearest(report, b, a));
  report.change = change_a ? report.weakest_a : report.weakest_b;
  return report;
}

}  // namespace weft
