#include "simulation/panel_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>

namespace weft {
namespace {

constexpr double kMarginCells = 0.45;  // of centres from the outline

double Cross(const BoardPoint& a, const BoardPoint& b, const BoardPoint& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

// Grid of flags with a border of one cell around.
class CellMask {
 public:
  CellMask(int row0, int col0, int rows, int cols)
      : row0_(row0 - 1), col0_(col0 - 1), rows_(rows + 2), cols_(cols + 2), on_(size_t(rows_) * cols_, 0) {}
  bool at(int r, int c) const { return on_[Index(r, c)] != 0; }
  void set(int r, int c, bool on) { on_[Index(r, c)] = on ? 1 : 0; }
  int row_begin() const { return row0_ + 1; }
  int row_end() const { return row0_ + rows_ - 1; }
  int col_begin() const { return col0_ + 1; }
  int col_end() const { return col0_ + cols_ - 1; }
  // The square of centres with (r, c) at its upper left.
  bool Quad(int r, int c) const { return at(r, c) && at(r + 1, c) && at(r, c + 1) && at(r + 1, c + 1); }

 private:
  size_t Index(int r, int c) const { return static_cast<size_t>(r - row0_) * cols_ + (c - col0_); }
  int row0_, col0_, rows_, cols_;
  std::vector<uint8_t> on_;
};

CellMask CellsInside(const std::vector<BoardPoint>& outline) {
  BoardPoint low = outline[0], high = outline[0];
  for (const BoardPoint& p : outline) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const int row0 = static_cast<int>(std::floor(low.y())), col0 = static_cast<int>(std::floor(low.x()));
  const int rows = static_cast<int>(std::ceil(high.y())) - row0;
  const int cols = static_cast<int>(std::ceil(high.x())) - col0;
  CellMask mask(row0, col0, rows, cols);
  // Even-odd rule row by row, then centres near the outline are taken out.
  for (int r = row0; r < row0 + rows; ++r) {
    const double y = r + 0.5;
    std::vector<double> crossings;
    for (size_t i = 0; i < outline.size(); ++i) {
      const BoardPoint &a = outline[i], &b = outline[(i + 1) % outline.size()];
      if ((a.y() > y) != (b.y() > y))
        crossings.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
    std::sort(crossings.begin(), crossings.end());
    for (size_t k = 0; k + 1 < crossings.size(); k += 2)
      for (int c = col0; c < col0 + cols; ++c)
        if (c + 0.5 > crossings[k] && c + 0.5 < crossings[k + 1]) mask.set(r, c, true);
  }
  for (size_t i = 0; i < outline.size(); ++i) {
    const BoardPoint a = outline[i], d = outline[(i + 1) % outline.size()] - a;
    const BoardPoint first = a.cwiseMin(a + d), last = a.cwiseMax(a + d);
    for (int r = std::max(row0, int(std::floor(first.y())) - 1);
         r <= std::min(row0 + rows - 1, int(last.y()) + 1); ++r)
      for (int c = std::max(col0, int(std::floor(first.x())) - 1);
           c <= std::min(col0 + cols - 1, int(last.x()) + 1); ++c) {
        const BoardPoint p(c + 0.5, r + 0.5);
        const double t = std::clamp((p - a).dot(d) / std::max(d.squaredNorm(), 1e-12), 0.0, 1.0);
        if ((p - a - t * d).norm() < kMarginCells) mask.set(r, c, false);
      }
  }
  return mask;
}

// Takes out centres that belong to no square, and those where squares touch by a corner only.
void Clean(CellMask& mask) {
  for (bool changed = true; changed;) {
    changed = false;
    for (int r = mask.row_begin(); r < mask.row_end(); ++r)
      for (int c = mask.col_begin(); c < mask.col_end(); ++c) {
        if (!mask.at(r, c)) continue;
        const bool a = mask.Quad(r - 1, c - 1), b = mask.Quad(r - 1, c);
        const bool d = mask.Quad(r, c - 1), e = mask.Quad(r, c);
        if ((a || b || d || e) && !(a && e && !b && !d) && !(b && d && !a && !e)) continue;
        mask.set(r, c, false);
        changed = true;
      }
  }
}

// The border of a mesh of faces as one loop of nodes, against the faces' sense; empty if there are several.
std::vector<int> BorderLoop(const std::vector<Face>& faces) {
  std::map<std::pair<int, int>, int> directed;
  for (const Face& f : faces)
    for (int k = 0; k < 3; ++k) directed[{f[k], f[(k + 1) % 3]}] = 1;
  std::map<int, int> next;
  for (const auto& [edge, one] : directed)
    if (!directed.count({edge.second, edge.first})) next[edge.first] = edge.second;
  std::vector<int> loop;
  if (next.empty()) return loop;
  int at = next.begin()->first;
  do {
    loop.push_back(at);
    at = next[at];
  } while (at != loop.front() && loop.size() <= next.size());
  if (loop.size() != next.size()) loop.clear();
  return loop;
}

// Cost of a triangle's shape, 1 for an equilateral one; none for one that is turned over or has no area.
double ShapeCost(const BoardPoint& a, const BoardPoint& b, const BoardPoint& c) {
  const double area2 = -Cross(a, b, c);
  if (area2 < 1e-3) return std::numeric_limits<double>::infinity();
  const double edges2 = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  const double shape = edges2 / (2 * std::sqrt(3.0) * area2);
  return shape * shape;
}

// Triangles between two closed loops of the same orientation by dynamic programming (Fuchs et al. 1977).
// State (i, j) has used i edges of the inner and j of the outer loop. Empty when there is none.
std::vector<Face> Zip(const std::vector<int>& inner, const std::vector<int>& outer,
                      const std::vector<BoardPoint>& at) {
  const size_t n = inner.size(), m = outer.size();
  const auto in = [&](size_t i) { return inner[i % n]; };
  const auto out = [&](size_t j) { return outer[j % m]; };
  std::vector<double> cost((n + 1) * (m + 1), std::numeric_limits<double>::infinity());
  std::vector<uint8_t> from_inner(cost.size(), 0);
  const auto index = [m](size_t i, size_t j) { return i * (m + 1) + j; };
  cost[0] = 0;
  for (size_t i = 0; i <= n; ++i)
    for (size_t j = 0; j <= m; ++j) {
      if (i > 0) {
        const double c = cost[index(i - 1, j)];
        const double sum = std::isfinite(c) ? c + ShapeCost(at[in(i)], at[in(i - 1)], at[out(j)]) : c;
        if (sum < cost[index(i, j)]) cost[index(i, j)] = sum, from_inner[index(i, j)] = 1;
      }
      if (j > 0) {
        const double c = cost[index(i, j - 1)];
        const double sum = std::isfinite(c) ? c + ShapeCost(at[out(j - 1)], at[out(j)], at[in(i)]) : c;
        if (sum < cost[index(i, j)]) cost[index(i, j)] = sum, from_inner[index(i, j)] = 0;
      }
    }
  std::vector<Face> faces;
  if (!std::isfinite(cost.back())) return faces;
  for (size_t i = n, j = m; i + j > 0;) {
    if (from_inner[index(i, j)]) {
      faces.push_back({in(i), in(i - 1), out(j)});
      --i;
    } else {
      faces.push_back({out(j - 1), out(j), in(i)});
      --j;
    }
  }
  return faces;
}

// Rotates the loops so that both begin at their nearest pair of points.
void Align(std::vector<int>& inner, std::vector<int>& outer, const std::vector<BoardPoint>& at) {
  double best = std::numeric_limits<double>::infinity();
  size_t best_i = 0, best_j = 0;
  for (size_t i = 0; i < inner.size(); ++i)
    for (size_t j = 0; j < outer.size(); ++j) {
      const double d = (at[inner[i]] - at[outer[j]]).squaredNorm();
      if (d < best) best = d, best_i = i, best_j = j;
    }
  std::rotate(inner.begin(), inner.begin() + best_i, inner.end());
  std::rotate(outer.begin(), outer.begin() + best_j, outer.end());
}

}  // namespace

BoardPoint PanelMesh::NodeAt(const std::vector<BoardPoint>& outline, int node) const {
  if (node < static_cast<int>(outline.size())) return outline[node];
  const VertexNode& cell = cells[node - outline.size()];
  return BoardPoint(cell.col + 0.5, cell.row + 0.5);
}

absl::StatusOr<PanelMesh> MeshPanel(const std::vector<BoardPoint>& outline) {
  CellMask mask = CellsInside(outline);
  Clean(mask);
  PanelMesh mesh;
  std::vector<BoardPoint> at = outline;
  std::map<std::pair<int, int>, int> node;
  for (int r = mask.row_begin(); r < mask.row_end(); ++r)
    for (int c = mask.col_begin(); c < mask.col_end(); ++c)
      if (mask.at(r, c)) {
        node[{r, c}] = static_cast<int>(at.size());
        at.emplace_back(c + 0.5, r + 0.5);
        mesh.cells.push_back({r, c});
      }
  for (int r = mask.row_begin(); r < mask.row_end(); ++r)
    for (int c = mask.col_begin(); c < mask.col_end(); ++c) {
      if (!mask.Quad(r, c)) continue;
      const int v[4] = {node[{r, c}], node[{r + 1, c}], node[{r + 1, c + 1}], node[{r, c + 1}]};
      const int turn = (r + c) % 2;  // diagonals alternate: the cloth bends alike in both directions
      mesh.faces.push_back({v[turn], v[1 + turn], v[2 + turn]});
      mesh.faces.push_back({v[turn], v[2 + turn], v[(3 + turn) % 4]});
    }
  std::vector<int> inner = BorderLoop(mesh.faces), outer(outline.size());
  if (inner.empty()) return absl::InvalidArgumentError("no room for connected cells inside the outline");
  for (size_t i = 0; i < outer.size(); ++i) outer[i] = static_cast<int>(i);
  double area = 0;
  for (size_t i = 0; i < outline.size(); ++i)
    area += Cross(BoardPoint::Zero(), outline[i], outline[(i + 1) % outline.size()]);
  if (area > 0) std::reverse(outer.begin(), outer.end());
  Align(inner, outer, at);
  const std::vector<Face> strip = Zip(inner, outer, at);
  if (strip.empty()) return absl::InvalidArgumentError("the outline is too narrow somewhere");
  mesh.faces.insert(mesh.faces.end(), strip.begin(), strip.end());
  return mesh;
}

}  // namespace weft
