#include "simulation/folded_cloth.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"
#include "base/angles.h"
#include "base/status_macros.h"
#include "simulation/hung_cloth.h"
#include "simulation/random.h"

namespace weft {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPleatDepthCells = 2.25;  // of the sewn pleats, from their inner to their outer folds
constexpr int kFewestPleatedCols = 168;    // around a narrower waist pleats pass through each other
constexpr double kPressedDeg = 110;        // a pressed crease without load
constexpr int kUncutRows = 8;              // above the strips
constexpr int kNarrowestStrip = 8, kWidestStrip = 13;
constexpr double kSlitOpenCells = 0.15;  // to each side, before the hems curl
constexpr double kCurlCells = 6;         // width of the part of a hem that curls
constexpr double kCurlTurnDeg = 300;     // by which the edge of the tightest hem points elsewhere

int WholeBetween(uint64_t key, uint64_t counter, int low, int high) {
  return low + static_cast<int>(UniformOf(key, counter) * (high - low + 1));
}

// A smooth curve through random values, -1 to 1, that repeats after `period`.
double FoldNoise(uint64_t key, double at, int period) {
  const double below = std::floor(at), t = at - below;
  const auto value = [&](double k) {
    const int wrapped = (static_cast<int>(k) % period + period) % period;
    return 2 * UniformOf(key, wrapped) - 1;
  };
  const double s = t * t * (3 - 2 * t);
  return (1 - s) * value(below) + s * value(below + 1);
}

// Creases on the edges between neighbours of a row or column of the grid; `down` gives the angle of an edge
// that runs down the cloth, `across` that of one along a row, for the grid place (i, j) of its first end.
void AddCreases(const std::function<double(int, int)>& down, const std::function<double(int, int)>& across,
                FoldedCloth* out) {
  const Cloth& c = out->cloth;
  const auto add = [&](int a, int b, double angle_rad) {
    if (angle_rad != 0) out->creases.push_back({a, b, angle_rad});
  };
  for (int i = 0; i < c.grid_rows; ++i)
    for (int j = 0; j < c.grid_cols; ++j) {
      if (i + 1 < c.grid_rows) add(c.vertex_at(i, j), c.vertex_at(i + 1, j), down(i, j));
      if (c.closed || j + 1 < c.grid_cols)
        add(c.vertex_at(i, j), c.vertex_at(i, (j + 1) % c.grid_cols), across(i, j));
    }
}

double None(int, int) { return 0; }

void Hold(int vertex, const Vector3d& to_mm, FoldedCloth* out) {
  out->held.push_back(vertex);
  out->held_from_mm.push_back(out->start_mm[vertex]);
  out->held_to_mm.push_back(to_mm);
}

// Hips and two walking legs that fit into a waist of this radius.
std::vector<SwingingCapsule> LowerBody(double waist_mm, double height_mm) {
  const double top = -height_mm / 2, hip = top + 0.3 * height_mm, foot = top + 1.25 * height_mm;
  const double deep = 0.74 * waist_mm, wide = waist_mm - deep, leg = 0.42 * waist_mm;
  std::vector<SwingingCapsule> out = {{{{-wide, hip, 0}, {wide, hip, 0}, deep, deep}, {0, hip, 0}, 0},
                                      {{{-wide, top, 0}, {wide, top, 0}, deep, deep}, {0, top, 0}, 0}};
  for (const double side : {-1.0, 1.0}) {
    const double x = side * 0.5 * waist_mm;
    out.push_back({{{x, hip, 0}, {x, foot, 0}, leg, 0.75 * leg}, {x, hip, 0}, side * 16 * kRadPerDeg});
  }
  return out;
}

// Where folds lie around the waist, in cells, and the shape that they give to it.
class PleatPath {
 public:
  PleatPath(int cols, double cell_mm, uint64_t seed) : cell_mm_(cell_mm) {
    ChooseFlanks(cols, seed);
    const double depth = kPleatDepthCells * cell_mm;
    double low = depth, high = cols * cell_mm / kTurn;
    for (int k = 0; k < 60; ++k) {
      inner_mm_ = (low + high) / 2;
      (TurnOf(depth) > kTurn ? low : high) = inner_mm_;
    }
    outer_mm_ = inner_mm_ + depth;
    double at = 0.5, angle = 0;
    for (size_t k = 0; k < flanks_.size(); ++k) {
      folds_.push_back({at, angle, k % 2 == 1});
      at += flanks_[k];
      angle += (k % 2 == 0 ? 1 : -1) * AngleOf(flanks_[k], kPleatDepthCells * cell_mm);
    }
  }

  double inner_mm() const { return inner_mm_; }

  // x and z at a place along the border, 0 to `cols` cells.
  Vector2d At(double cells) const {
    const size_t n = folds_.size();
    size_t k = n - 1;  // the last flank goes on behind the seam
    for (size_t i = 0; i < n; ++i)
      if (folds_[i].cells <= cells) k = i;
    const double from = cells < folds_[0].cells ? folds_[n - 1].cells - Total() : folds_[k].cells;
    if (cells < folds_[0].cells) k = n - 1;
    const double t = (cells - from) / flanks_[k];
    return (1 - t) * Corner(folds_[k]) + t * Corner(folds_[(k + 1) % n]);
  }
  // Angle of the crease at a place: above 0 at outer folds, below at inner ones, else 0.
  double CreaseAt(double cells) const {
    for (const Fold& f : folds_)
      if (std::abs(f.cells - cells) < 1e-6) return (f.outer ? 1 : -1) * kPressedDeg * kRadPerDeg;
    return 0;
  }

 private:
  struct Fold {
    double cells, angle;
    bool outer;
  };
  double Total() const {
    double sum = 0;
    for (const int f : flanks_) sum += f;
    return sum;
  }
  Vector2d Corner(const Fold& f) const {
    const double radius = f.outer ? outer_mm_ : inner_mm_;
    return {radius * std::sin(f.angle), -radius * std::cos(f.angle)};
  }
  // Around the body, of a flank with its ends `depth` apart across.
  double AngleOf(int cells, double depth) const {
    const double a = inner_mm_, b = inner_mm_ + depth, length = cells * cell_mm_;
    return std::acos(std::clamp((a * a + b * b - length * length) / (2 * a * b), -1.0, 1.0));
  }
  double TurnOf(double depth) const {
    double sum = 0;
    for (size_t k = 0; k < flanks_.size(); ++k) sum += (k % 2 == 0 ? 1 : -1) * AngleOf(flanks_[k], depth);
    return sum;
  }
  // Outwards and back in turn; all together as long as the border.
  void ChooseFlanks(int cols, uint64_t seed) {
    constexpr int kShortest = 5, kLongest = 8;
    const uint64_t key = KeyOf(seed, "pleats");
    const auto pleats = static_cast<int>(std::lround(cols / 9.5));
    int sum = 0;
    for (int k = 0; k < pleats; ++k) {
      flanks_.push_back(WholeBetween(key, 2 * k, kShortest, kLongest - 1));
      flanks_.push_back(WholeBetween(key, 2 * k + 1, 3, 4));
      sum += flanks_[2 * k] + flanks_[2 * k + 1];
    }
    for (uint64_t k = 0; sum != cols; ++k) {
      int& flank = flanks_[2 * WholeBetween(key, 1000 + k, 0, pleats - 1)];
      const int by = sum < cols ? 1 : -1;
      if (flank + by < kShortest || flank + by > kLongest) continue;
      flank += by, sum += by;
    }
  }

  double cell_mm_, inner_mm_ = 0, outer_mm_ = 0;
  std::vector<int> flanks_;  // in cells
  std::vector<Fold> folds_;
};

absl::StatusOr<FoldedCloth> Begin(const ClothOptions& shape) {
  WEFT_ASSIGN_OR_RETURN(Cloth cloth, BuildCloth(shape));
  FoldedCloth out;
  out.cloth = std::move(cloth);
  out.start_mm = out.cloth.rest.vertices_mm;
  return out;
}

// A little noise breaks what symmetry there is; the seed decides how the cloth folds.
void Disturb(const PerformanceOptions& options, double share, FoldedCloth* out) {
  const uint64_t key = KeyOf(options.seed, "disturbance");
  const std::vector<Vector3d> normals = VertexNormals(out->start_mm, out->cloth.rest.faces);
  for (size_t v = 0; v < out->start_mm.size(); ++v)
    out->start_mm[v] += share * options.cell_mm * std::clamp(NormalOf(key, v), -2.0, 2.0) * normals[v];
}

// A sheet cut into strips below its upper border; their widths differ.
ClothOptions StripsOf(const PerformanceOptions& options) {
  ClothOptions out = ClothOptionsOf(options);
  const uint64_t key = KeyOf(options.seed, "strips");
  out.slits_from = std::min(kUncutRows, options.rows - 2);
  for (int at = 0;;) {
    at += WholeBetween(key, out.slits.size(), kNarrowestStrip, kWidestStrip);
    if (at > options.cols - kNarrowestStrip) break;
    out.slits.push_back(at);
  }
  return out;
}

// Hem of one strip: how many cells to its left and right edge.
struct ToEdges {
  double left, right;
};
ToEdges EdgesAround(const ClothOptions& o, double row, double col) {
  ToEdges out = {col, o.cols - col};
  if (row < o.slits_from + 0.5) return out;
  for (const int slit : o.slits) {
    if (slit <= col) out.left = std::min(out.left, col - slit);
    if (slit >= col) out.right = std::min(out.right, slit - col);
  }
  return out;
}

void HoldOnHooks(const PerformanceOptions& options, FoldedCloth* out) {
  const Cloth& c = out->cloth;
  const uint64_t key = KeyOf(options.seed, "hooks");
  const int gaps = std::max(2, (c.grid_cols - 1) / 6);
  for (int k = 0; k <= gaps; ++k) {
    const int v = c.vertex_at(0, k * (c.grid_cols - 1) / gaps);
    const Vector3d& rest = c.rest.vertices_mm[v];
    const double z = (k % 2 == 0 ? 1 : -1) * options.cell_mm * (0.8 + 0.6 * UniformOf(key, k));
    Hold(v, {rest.x() * (1 - options.handles.compression), rest.y(), z}, out);
  }
}

}  // namespace

absl::StatusOr<FoldedCloth> MakePleatedSkirt(const PerformanceOptions& options) {
  absl::StatusOr<FoldedCloth> out = Begin(ClothOptionsOf(options));
  if (!out.ok()) return out;
  const Cloth& c = out->cloth;
  if (options.cols < kFewestPleatedCols) {
    return absl::InvalidArgumentError(absl::StrCat("performance: cols is ", options.cols,
                                                   ", a pleated skirt has ", kFewestPleatedCols, " or more"));
  }
  const PleatPath path(options.cols, options.cell_mm, options.seed);
  for (int i = 0; i < c.grid_rows; ++i)
    for (int j = 0; j < c.grid_cols; ++j) {
      Vector3d& p = out->start_mm[c.vertex_at(i, j)];
      const Vector2d at = path.At(c.col_position[j]);
      p = {at.x(), p.y(), at.y()};
    }
  const std::vector<Vector3d> sewn_mm = out->start_mm;
  Disturb(options, 0.01, &*out);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < c.grid_cols; ++j) Hold(c.vertex_at(i, j), sewn_mm[c.vertex_at(i, j)], &*out);
  AddCreases([&](int, int j) { return path.CreaseAt(c.col_position[j]); }, None, &*out);
  out->body = LowerBody(path.inner_mm() - options.cell_mm, options.rows * options.cell_mm);
  return out;
}

absl::StatusOr<FoldedCloth> MakeGatheredSkirt(const PerformanceOptions& options) {
  absl::StatusOr<FoldedCloth> out = Begin(ClothOptionsOf(options));
  if (!out.ok()) return out;
  const Cloth& c = out->cloth;
  const uint64_t key = KeyOf(options.seed, "stitches");
  Disturb(options, 0.1, &*out);
  std::vector<int> stitches;
  for (int j = 0; j < c.grid_cols - 2;) {
    stitches.push_back(j);
    j += WholeBetween(key, stitches.size(), 4, 9);
  }
  const double ring_mm = (1 - options.handles.compression) * options.cols * options.cell_mm / kTurn;
  for (const int i : {0, 3})
    for (size_t k = 0; k < stitches.size(); ++k) {
      const uint64_t counter = 1000 + 2 * (k + i * stitches.size());
      const double angle = kTurn * (static_cast<double>(k) / static_cast<double>(stitches.size()) - 0.5);
      const double radius = ring_mm + 0.3 * options.cell_mm * (2 * UniformOf(key, counter) - 1);
      const int v = c.vertex_at(i, stitches[k]);
      Hold(v, {radius * std::sin(angle), out->start_mm[v].y(), -radius * std::cos(angle)}, &*out);
    }
  out->body = LowerBody(ring_mm - 2 * options.cell_mm, options.rows * options.cell_mm);
  return out;
}

absl::StatusOr<FoldedCloth> MakeCurlingSheet(const PerformanceOptions& options) {
  absl::StatusOr<FoldedCloth> out = Begin(StripsOf(options));
  if (!out.ok()) return out;
  const Cloth& c = out->cloth;
  const uint64_t key = KeyOf(options.seed, "curls");
  Disturb(options, 0.03, &*out);
  for (const auto& edges : c.slit_edges)
    for (int side = 0; side < 2; ++side)
      for (size_t k = 1; k < edges[side].size(); ++k)
        out->start_mm[edges[side][k]].x() += (side == 0 ? -1 : 1) * kSlitOpenCells * options.cell_mm;
  HoldOnHooks(options, &*out);
  // Curvature grows linearly towards the edge and differs along it, smoothly. The turn at a line of cells is
  // that of half the way to its neighbours, one cell, and less where the edge itself is nearer.
  const auto turn = [&](double to_edge, double along, uint64_t side) -> double {
    if (to_edge > kCurlCells || to_edge < 0.25) return 0;
    const double tightness = 0.75 + 0.25 * FoldNoise(key + side, along / 9, 1000);
    const double per_cell = 2 * kCurlTurnDeg * kRadPerDeg / kCurlCells * (1 - to_edge / kCurlCells);
    return tightness * per_cell * (to_edge < 0.75 ? 0.75 : 1);
  };
  const auto down = [&](int i, int j) -> double {
    const double col = c.col_position[j], row = c.row_position[i];
    const ToEdges to = EdgesAround(c.options, row, col);
    const auto place = static_cast<uint64_t>(col);
    return turn(to.left, row, 100 + place) + turn(to.right, row, 500 + place);
  };
  const auto across = [&](int i, int j) -> double {
    return -turn(options.rows - c.row_position[i], c.col_position[j], 3);
  };
  AddCreases(down, across, &*out);
  return out;
}

}  // namespace weft
