#include "tests/benchmark/center_bound.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "base/median.h"
#include "pattern/fit/cell.h"
#include "pattern/seeds/patch_decoder.h"

namespace weft::testing {
namespace {

constexpr int kSide = 24;  // points along a side of the window, which reaches one cell to all sides
constexpr double kStep = 2.0 / kSide;
double PointAt(int k) { return (k + 0.5) * kStep - 1; }

using TruthByNode = std::map<BoardNode, const NodeTruth*>;

TruthByNode Visible(const ViewTruth& truth) {
  TruthByNode visible;
  for (const NodeTruth& node : truth.nodes) {
    if (node.visible && node.node.kind == NodeKind::kCenter) visible[node.node] = &node;
  }
  return visible;
}

// The true centres of a cell and its neighbours, where all are in sight.
std::optional<NineCenters> NodesOf(const TruthByNode& visible, const BoardNode& node) {
  NineCenters nodes;
  for (int k = 0; k < 9; ++k) {
    const auto at = visible.find({node.row + k / 3 - 1, node.col + k % 3 - 1, NodeKind::kCenter});
    if (at == visible.end()) return std::nullopt;
    nodes.x[k] = static_cast<float>(at->second->pixel_px.x());
    nodes.y[k] = static_cast<float>(at->second->pixel_px.y());
  }
  return nodes;
}

// Blurred squares of the cells -2 to 2 along an axis, and their slopes.
struct Profile {
  double value[5][kSide], slope[5][kSide];

  Profile(double square_fraction, double sigma) {
    const double half = square_fraction / 2;
    const auto edge = [&](double t) { return 0.5 * std::erf(t / (sigma * M_SQRT2)); };
    const auto density = [&](double t) {
      return std::exp(-t * t / (2 * sigma * sigma)) / (sigma * std::sqrt(2 * M_PI));
    };
    for (int cell = 0; cell < 5; ++cell) {
      for (int k = 0; k < kSide; ++k) {
        const double d = PointAt(k) - (cell - 2);
        value[cell][k] = edge(d + half) - edge(d - half);
        slope[cell][k] = density(d + half) - density(d - half);
      }
    }
  }
};

// A point of the window: where it is in the picture, and how that moves with u and v.
struct Place {
  double x, y, x_u, y_u, x_v, y_v;
};
Place PlaceAt(const NineCenters& n, double u, double v) {
  const int left = u < 0 ? 0 : 1, up = v < 0 ? 0 : 1;
  const double s = u - (left - 1), t = v - (up - 1);
  const int k = 3 * up + left;
  const auto of = [&](const float* p, double* value, double* by_u, double* by_v) {
    const double a = p[k], b = p[k + 1], c = p[k + 3], d = p[k + 4];
    *value = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d);
    *by_u = (1 - t) * (b - a) + t * (d - c);
    *by_v = (1 - s) * (c - a) + s * (d - b);
  };
  Place place;
  of(n.x, &place.x, &place.x_u, &place.x_v);
  of(n.y, &place.y, &place.y_u, &place.y_v);
  return place;
}

// What the print of a cell looks like at light 1, and how it changes along u and v.
class Print {
 public:
  Print(const Board& board, const Appearance& appearance, const BoardNode& node, const CellPose& pose)
      : along_u_(board.square_fraction, appearance.sigma_px * std::hypot(pose.bx, pose.by) / pose.Area()),
        along_v_(board.square_fraction, appearance.sigma_px * std::hypot(pose.ax, pose.ay) / pose.Area()),
        black_(appearance.black) {
    for (int k = 0; k < 25; ++k) {
      const int row = node.row + k / 5 - 2, col = node.col + k % 5 - 2;
      for (int c = 0; c < 3; ++c) {
        colors_[k / 5][k % 5][c] =
            board.Contains(row, col)
                ? appearance.inks[static_cast<int>(board.at(row, col))][c] - appearance.black[c]
                : 0;
      }
    }
  }

  struct Value {
    double t, by_u, by_v;
  };
  Value At(int i, int j, int channel) const {
    Value value{black_[channel], 0, 0};
    for (int a = 0; a < 5; ++a) {
      double row = 0, slope = 0;
      for (int b = 0; b < 5; ++b) {
        row += colors_[a][b][channel] * along_u_.value[b][j];
        slope += colors_[a][b][channel] * along_u_.slope[b][j];
      }
      value.t += row * along_v_.value[a][i];
      value.by_u += slope * along_v_.value[a][i];
      value.by_v += row * along_v_.slope[a][i];
    }
    return value;
  }

 private:
  Profile along_u_, along_v_;
  Rgb black_;
  double colors_[5][5][3];
};

// Of a pixel by x and y of the centre, gain and offset of the light.
using Derivatives = Eigen::Vector4d;

// Zeros where there is no print to be seen.
CenterBound Bound(const ColorImage& image, const Print& print, const NineCenters& nodes, double noise) {
  // For a gain of 1; the gain itself follows from the picture.
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d target = Eigen::Vector2d::Zero();
  double squares = 0;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const double u = PointAt(j), v = PointAt(i);
      const Place at = PlaceAt(nodes, u, v);
      const double area = at.x_u * at.y_v - at.x_v * at.y_u;
      if (!(area > 0)) return {};  // folded
      const double pixels = area * kStep * kStep, tent = (1 - std::abs(u)) * (1 - std::abs(v));
      const Rgb seen = SampleColor(image, static_cast<float>(at.x), static_cast<float>(at.y));
      for (int c = 0; c < 3; ++c) {
        const Print::Value p = print.At(i, j, c);
        // What moves with the centre is farther back in the print at the same pixel.
        const double by_x = -tent * (p.by_u * at.y_v - p.by_v * at.y_u) / area,
                     by_y = -tent * (p.by_v * at.x_u - p.by_u * at.x_v) / area;
        const Derivatives d(by_x, by_y, p.t, 1);
        information += pixels * d * d.transpose();
        normal += pixels * d.tail<2>() * d.tail<2>().transpose();
        target += pixels * seen[c] * d.tail<2>();
        squares += pixels * seen[c] * seen[c];
      }
    }
  }
  const Eigen::Vector2d light = normal.ldlt().solve(target);
  const double gain = light[0];
  if (!(gain > 0)) return {};
  const Eigen::Matrix4d covariance = information.inverse();
  const double for_one_grey_level = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1))) / gain;
  // Interpolation between pixels has taken a part of the noise away, little of what is coarser.
  const double residual = std::sqrt(std::max(squares - light.dot(target), 0.0) / normal(1, 1));
  return {noise * for_one_grey_level, std::max(noise, residual) * for_one_grey_level};
}

// Second differences along both axes of noise alone have 36 times its variance (Immerkaer 1996).
double NoiseOfTile(const ColorImage& image, int x0, int y0, int side) {
  double squares = 0;
  int n = 0;
  for (int y = y0 + 1; y + 1 < y0 + side; ++y) {
    for (int x = x0 + 1; x + 1 < x0 + side; ++x) {
      for (int c = 0; c < 3; ++c) {
        const auto at = [&](int dx, int dy) { return static_cast<double>(image.at(x + dx, y + dy)[c]); };
        // What is cut off at black and white has no noise.
        if (at(0, 0) < 4 || at(0, 0) > 250) return -1;
        const double second = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1) + 4 * at(0, 0) -
                              2 * (at(0, -1) + at(0, 1) + at(-1, 0) + at(1, 0));
        squares += second * second / 36;
        ++n;
      }
    }
  }
  return std::sqrt(squares / n);
}

// A fifth of the tiles is taken to be plain: their middle is the tenth of all.
double NoiseOf(const ColorImage& image) {
  constexpr int kTilePx = 16;
  std::vector<double> tiles;
  for (int y = 0; y + kTilePx <= image.height_px; y += kTilePx) {
    for (int x = 0; x + kTilePx <= image.width_px; x += kTilePx) {
      const double noise = NoiseOfTile(image, x, y, kTilePx);
      if (noise >= 0) tiles.push_back(noise);
    }
  }
  return Quantile(tiles, 0.1);
}

}  // namespace

PictureLook MeasureLook(const TrueView& view, const Board& board) {
  constexpr size_t kCells = 300;
  const TruthByNode visible = Visible(view.truth);
  std::vector<PlacedCell> all, cells;
  for (const auto& [node, truth] : visible) {
    const auto nodes = NodesOf(visible, node);
    if (!nodes || !truth->scoreable) continue;
    CellPose pose;
    CellWarp warp;
    Interpolate(*nodes, &pose, &warp);
    all.push_back({node.row, node.col, pose});
  }
  for (size_t k = 0; k < all.size(); k += std::max<size_t>(1, all.size() / kCells)) cells.push_back(all[k]);
  std::vector<float> sigmas_px;
  for (float sigma_px = 0.4f; sigma_px < 4; sigma_px *= 1.08f) sigmas_px.push_back(sigma_px);
  Appearance start;
  for (Rgb& ink : start.inks) ink.fill(100);
  start.black.fill(25);
  PictureLook look;
  const std::vector<ColorImage> image = {*ToColorImage(view.image)};
  look.appearance =
      CalibrateAppearance({image, board, SampledProfile(board.square_fraction)}, cells, sigmas_px, start);
  look.noise = NoiseOf(image[0]);
  return look;
}

std::map<BoardNode, CenterBound> CenterBounds(const TrueView& view, const Board& board,
                                              const PictureLook& look) {
  const TruthByNode visible = Visible(view.truth);
  const ColorImage image = *ToColorImage(view.image);
  std::map<BoardNode, CenterBound> bounds;
  for (const auto& [node, truth] : visible) {
    const auto nodes = NodesOf(visible, node);
    if (!nodes) continue;
    CellPose pose;
    CellWarp warp;
    Interpolate(*nodes, &pose, &warp);
    if (!(pose.Area() > 1)) continue;
    const CenterBound bound = Bound(image, Print(board, look.appearance, node, pose), *nodes, look.noise);
    if (bound.noise_px > 0) bounds[node] = bound;
  }
  return bounds;
}

}  // namespace weft::testing
