#include "pattern/surface/center_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace weft {
namespace {

// Weight of what may be hidden.
constexpr float kUnknownWeight = 0.2f;

// The edge to an unknown neighbour on the board, over the edge on the other side of the cell. Cells hide
// mostly where cloth turns away from the camera: edges shrink towards the fold, and the next one shrinks
// kShrinks times as much. One of kFoldedEdges is taken where it explains more of the image, by kEdgePrior
// times the square of its distance from that expectation. `accuracy_decode` on pleats, gathers and curls with
// seed 1 (docs/decoding-accuracy-history.md), November 2026. Edges around a cylinder shrink with a kShrinks
// of 1 at first, and of more towards its crest.
constexpr float kLongestHidden = 0.93f, kShortestHidden = 0.1f, kShrinks = 2;
constexpr float kFoldedEdges[] = {0.6f, 0.3f, 0};
constexpr float kEdgePrior = 0.3f;

constexpr float kLongestStep = 0.3f;  // cells

// Scales of the Cauchy distributions, in edges of a cell that faces the camera: along the longer axis of the
// cell in the image, and across it, where centres go when the cloth bends out of its surface.
struct CauchyScale {
  float along, across;
};
constexpr CauchyScale kFourthDifference = {0.1f, 0.2f}, kSecondDifference = {0.03f, 0.1f},
                      kMixedDifference = {0.03f, 0.1f};

struct Center {
  float x = std::numeric_limits<float>::quiet_NaN(), y = 0;
  bool Known() const { return x == x; }
};

// The centres at their positions on the board, up to three rows and columns off it.
class CenterGrid {
 public:
  explicit CenterGrid(const BoardState& state)
      : columns_(state.board().cols + 2 * kBorder),
        centers_(static_cast<size_t>(columns_) * (state.board().rows + 2 * kBorder), Center{}) {
    for (const ViewCell& cell : state.cells()) *At(cell.row, cell.col) = {cell.fit.pose.x, cell.fit.pose.y};
  }

  Center* At(int row, int col) {
    return &centers_[static_cast<size_t>(row + kBorder) * columns_ + col + kBorder];
  }
  const Center* At(int row, int col) const { return const_cast<CenterGrid*>(this)->At(row, col); }
  int columns() const { return columns_; }

 private:
  static constexpr int kBorder = 3;
  int columns_;
  PixelVector<Center> centers_;
};

// Centres along a row or column of the board, three to both sides of one.
using Line = std::array<Center, 7>;

// The longer axis of a cell in the image.
struct LongAxis {
  explicit LongAxis(const CellPose& f) {
    const float xx = f.ax * f.ax + f.bx * f.bx, xy = f.ax * f.ay + f.bx * f.by,
                yy = f.ay * f.ay + f.by * f.by;
    const float half = 0.5f * (xx - yy), root = std::sqrt(half * half + xy * xy);
    squared_px2 = 0.5f * (xx + yy) + root;
    const float along_x = half > 0 ? half + root : xy, along_y = half > 0 ? xy : root - half;
    const float length = std::sqrt(along_x * along_x + along_y * along_y);
    if (length > 0) x = along_x / length, y = along_y / length;
  }

  float squared_px2 = 0;
  float x = 1, y = 0;
};

// Least squares of a centre by differences of centres, each with the weights of Cauchy distributions.
class PriorSums {
 public:
  explicit PriorSums(const LongAxis& axis) : axis_(axis) {}

  void AddLine(const Line& line) {
    const auto known = [&line](int first, int last) {
      return std::all_of(&line[first], &line[last] + 1, [](const Center& center) { return center.Known(); });
    };
    const bool here = known(1, 5);
    if (here) AddFourth(line, 1, 6);
    if (known(0, 4)) AddFourth(line, 0, -4);
    if (known(2, 6)) AddFourth(line, 2, -4);
    if (here) return;
    if (known(2, 4)) AddSecond(line, 2, -2);
    if (known(1, 3)) AddSecond(line, 1, 1);
    if (known(3, 5)) AddSecond(line, 3, 1);
  }

  // A difference in px, in which the centre itself counts `own` times.
  void Add(float x, float y, float own, const CauchyScale& scale) {
    const float along = axis_.x * x + axis_.y * y, across = axis_.x * y - axis_.y * x;
    const float along2 = scale.along * scale.along * axis_.squared_px2 + along * along,
                across2 = scale.across * scale.across * axis_.squared_px2 + across * across;
    const float inverse = own / (along2 * across2);  // divisions are slow
    const float along_precision = inverse * across2, across_precision = inverse * along2;
    precision_along_ += own * along_precision;
    precision_across_ += own * across_precision;
    along_ += along_precision * along;
    across_ += across_precision * across;
  }

  CenterNormal Sum() const {
    const float x = axis_.x, y = axis_.y;
    return {x * x * precision_along_ + y * y * precision_across_,
            x * y * (precision_along_ - precision_across_),
            y * y * precision_along_ + x * x * precision_across_, x * along_ - y * across_,
            y * along_ + x * across_};
  }

 private:
  void AddFourth(const Line& line, int first, float own) {
    const Center* p = &line[first];
    Add(p[0].x + p[4].x - 4 * (p[1].x + p[3].x) + 6 * p[2].x,
        p[0].y + p[4].y - 4 * (p[1].y + p[3].y) + 6 * p[2].y, own, kFourthDifference);
  }
  void AddSecond(const Line& line, int first, float own) {
    const Center* p = &line[first];
    Add(p[0].x + p[2].x - 2 * p[1].x, p[0].y + p[2].y - 2 * p[1].y, own, kSecondDifference);
  }

  const LongAxis& axis_;
  float precision_along_ = 0, precision_across_ = 0, along_ = 0, across_ = 0;
};

// A centre that is fitted, and what the image said where it was.
struct FittedCenter {
  size_t cell;
  float x, y;
  LongAxis axis;
  CenterNormal image;
};

class CenterSweep {
 public:
  CenterSweep(const CellFitter& fitter, BoardState* state)
      : fitter_(fitter), state_(*state), centers_(*state) {}

  template <typename Fixed>
  void Run(const Fixed& is_fixed) {
    std::vector<FittedCenter> fitted;
    for (size_t k = 0; k < state_.cells().size(); ++k) {
      ViewCell& cell = state_.cell(k);
      if (is_fixed(cell)) continue;
      FittedCenter center{k, cell.fit.pose.x, cell.fit.pose.y, LongAxis(cell.fit.pose), {}};
      CellFit fit = FitCenter(cell, &center.image);
      if (!fit.converged) continue;
      fit.pose = cell.fit.pose;
      cell.fit = fit;
      Move(center);
      fitted.push_back(center);
    }
    // What the prior says has changed since with the cells that come later.
    for (auto center = fitted.rbegin(); center != fitted.rend(); ++center) Move(*center);
  }

 private:
  // The cells that share an edge with one, as places among the nine; 8 - k lies across from k.
  static constexpr int kBeside[] = {1, 3, 5, 7};
  // To unknown neighbours, by their places, over the edges on the other side. 1 off the board.
  using HiddenEdges = std::array<float, 9>;

  struct Surroundings {
    NineCenters centers;  // the known ones
    NeighborWeights weights;
    bool IsKnown(int k) const { return weights[k] == 1; }
  };

  const Center& Near(const ViewCell& cell, int k, int steps) const {
    return *centers_.At(cell.row + steps * (k / 3 - 1), cell.col + steps * (k % 3 - 1));
  }

  Surroundings Around(const ViewCell& cell) const {
    Surroundings around;
    for (int k = 0; k < 9; ++k) {
      const Center& near = Near(cell, k, 1);
      around.centers.x[k] = near.x;
      around.centers.y[k] = near.y;
      around.weights[k] = near.Known() ? 1 : kUnknownWeight;
    }
    return around;
  }

  // False where no neighbour is hidden.
  bool ExpectHiddenEdges(const ViewCell& cell, const Surroundings& around, HiddenEdges* edges) const {
    bool any = false;
    for (const int k : kBeside) {
      (*edges)[k] = 1;
      if (around.IsKnown(k) || !state_.board().Contains(cell.row + k / 3 - 1, cell.col + k % 3 - 1)) continue;
      (*edges)[k] = ExpectedEdge(Near(cell, k, 0), Near(cell, 8 - k, 1), Near(cell, 8 - k, 2));
      any = true;
    }
    return any;
  }

  // By the two edges before.
  static float ExpectedEdge(const Center& here, const Center& one, const Center& two) {
    if (!one.Known() || !two.Known()) return kLongestHidden;
    const float x = here.x - one.x, y = here.y - one.y, x_before = one.x - two.x, y_before = one.y - two.y;
    const float length2 = x * x + y * y, before2 = x_before * x_before + y_before * y_before;
    const float shrinks = std::sqrt(length2 / std::max(before2, 1e-6f)) - 1;
    return std::clamp(1 + kShrinks * shrinks, kShortestHidden, kLongestHidden);
  }

  // The known centres, and where unknown ones are with such edges.
  static NineCenters Complete(const CellPose& f, const Surroundings& around, const HiddenEdges& edges) {
    NineCenters nodes = around.centers;
    for (const int k : kBeside) {
      if (around.IsKnown(k)) continue;
      // Off the board, and where the neighbour across is unknown, the cell's own edges say more.
      const bool from_across = around.IsKnown(8 - k) && edges[k] < 1;
      const float sign = k < 4 ? -1.0f : 1.0f;
      const float x = from_across ? f.x - nodes.x[8 - k] : sign * (k == 3 || k == 5 ? f.ax : f.bx);
      const float y = from_across ? f.y - nodes.y[8 - k] : sign * (k == 3 || k == 5 ? f.ay : f.by);
      nodes.x[k] = f.x + edges[k] * x;
      nodes.y[k] = f.y + edges[k] * y;
    }
    for (const int k : {0, 2, 6, 8}) {
      if (around.IsKnown(k)) continue;
      const int in_column = k < 3 ? 1 : 7, in_row = k % 3 == 0 ? 3 : 5;
      nodes.x[k] = nodes.x[in_column] + nodes.x[in_row] - f.x;
      nodes.y[k] = nodes.y[in_column] + nodes.y[in_row] - f.y;
    }
    return nodes;
  }

  // Fits a centre. Where neighbours are hidden, with those lengths of the edges to them that suit best.
  CellFit FitCenter(const ViewCell& cell, CenterNormal* image) const {
    const CellPose& f = cell.fit.pose;
    const Surroundings around = Around(cell);
    HiddenEdges expected;
    const bool any_hidden = ExpectHiddenEdges(cell, around, &expected);
    const auto fit_with = [&](const HiddenEdges& edges, CenterNormal* normal) {
      return fitter_.FitCenter(cell.row, cell.col, Complete(f, around, edges), around.weights, normal);
    };
    CellFit fit = fit_with(expected, image);
    if (!any_hidden || !fit.converged) return fit;
    std::optional<HiddenEdges> best;
    float best_score = fit.explained;
    for (const float folded : kFoldedEdges) {
      HiddenEdges edges = expected;
      float farthest = 0;
      for (const int k : kBeside) {
        if (edges[k] == 1) continue;
        farthest = std::max(farthest, std::abs(folded - edges[k]));
        edges[k] = folded;
      }
      const float against = kEdgePrior * farthest * farthest;
      if (1 - against <= best_score) continue;  // nothing explains more than all
      const CellFit other = fit_with(edges, nullptr);
      const float score = other.explained - against;
      if (!other.converged || score <= best_score) continue;
      best = edges;
      best_score = score;
    }
    return best ? fit_with(*best, image) : fit;
  }

  CenterNormal PriorOf(const ViewCell& cell, const LongAxis& axis) const {
    const Center* here = centers_.At(cell.row, cell.col);
    const int down = centers_.columns();
    PriorSums sums(axis);
    Line in_row, in_column;
    for (int k = -3; k <= 3; ++k) {
      in_row[k + 3] = here[k];
      in_column[k + 3] = here[k * down];
    }
    sums.AddLine(in_row);
    sums.AddLine(in_column);
    for (const int dr : {-1, 1}) {
      for (const int dc : {-1, 1}) {
        const Center beside = here[dc], above = here[dr * down], across = here[dr * down + dc];
        if (!beside.Known() || !above.Known() || !across.Known()) continue;
        sums.Add(here->x - beside.x - above.x + across.x, here->y - beside.y - above.y + across.y, 1,
                 kMixedDifference);
      }
    }
    return sums.Sum();
  }

  // To where image and prior want the centre, by their slopes where it is.
  void Move(const FittedCenter& center) {
    ViewCell& cell = state_.cell(center.cell);
    CellFit& fit = cell.fit;
    CellPose& f = fit.pose;
    const CenterNormal prior = PriorOf(cell, center.axis);
    const CenterNormal& image = center.image;
    const float dx = f.x - center.x, dy = f.y - center.y;
    const float xx = image.xx + prior.xx, xy = image.xy + prior.xy, yy = image.yy + prior.yy;
    const float x = image.x + image.xx * dx + image.xy * dy + prior.x,
                y = image.y + image.xy * dx + image.yy * dy + prior.y;
    const float inverse = 1 / (xx * yy - xy * xy);
    const float step_x = inverse * (xy * y - yy * x), step_y = inverse * (xy * x - xx * y);
    const float step_cells = InCells(f, step_x, step_y);
    const float shortened = step_cells > kLongestStep ? kLongestStep / step_cells : 1;
    f.x += shortened * step_x;
    f.y += shortened * step_y;
    *centers_.At(cell.row, cell.col) = {f.x, f.y};
    fit.moved_cells = InCells(f, dx + shortened * step_x, dy + shortened * step_y);
    // A Cauchy distribution knows less about its middle than its weights say: half as much, and measured
    // errors ask for a little more.
    constexpr float kKnown = 0.7f;
    const float known_xx = image.xx + kKnown * prior.xx, known_xy = image.xy + kKnown * prior.xy,
                known_yy = image.yy + kKnown * prior.yy;
    const float variance =
        0.5f * (known_xx + known_yy) / (known_xx * known_yy - known_xy * known_xy);  // mean of both axes
    fit.sigma_px = fit.noise / fitter_.noise() * std::sqrt(variance);
  }

  static float InCells(const CellPose& f, float x, float y) {
    const float u = f.by * x - f.bx * y, v = f.ax * y - f.ay * x;
    return std::sqrt(u * u + v * v) / std::abs(f.Area());
  }

  const CellFitter& fitter_;
  BoardState& state_;
  CenterGrid centers_;
};

}  // namespace

void SweepUnscored(const CellFitter& fitter, BoardState* state) {
  CenterSweep(fitter, state).Run([state](const ViewCell& cell) { return state->IsScored(cell); });
}

void SweepUnsettled(const CellFitter& fitter, float least_move_cells, BoardState* state) {
  CenterSweep(fitter, state).Run([=](const ViewCell& cell) {
    return cell.fit.moved_cells < least_move_cells;
  });
}

}  // namespace weft
