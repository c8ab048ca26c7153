#include "alignment/self_intersection.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace weft {
namespace {

constexpr double kMaxCells = 1 << 23;
constexpr double kCellPerExtent = 2;  // size of a cell against the mean extent of a face's box
constexpr int kCellsPerBlock = 1 << 14;

struct Box {
  Eigen::Vector3d low, high;

  bool Overlaps(const Box& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

std::vector<Box> BoxesOf(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces) {
  std::vector<Box> boxes;
  boxes.reserve(faces.size());
  for (const Face& f : faces) {
    const Eigen::Vector3d &a = vertices_mm[f[0]], &b = vertices_mm[f[1]], &c = vertices_mm[f[2]];
    boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
  }
  return boxes;
}

// Faces by the cells that their boxes touch.
class Grid {
 public:
  explicit Grid(const std::vector<Box>& boxes) {
    Eigen::Vector3d high = boxes[0].high;
    low_ = boxes[0].low;
    double extent = 0;
    for (const Box& box : boxes) {
      low_ = low_.cwiseMin(box.low);
      high = high.cwiseMax(box.high);
      extent += (box.high - box.low).maxCoeff() / static_cast<double>(boxes.size());
    }
    double cell = std::max(kCellPerExtent * extent, 1e-9);
    const auto count = [&] { return ((high - low_).array() / cell + 1).floor().prod(); };
    while (count() > kMaxCells) cell *= 1.25;
    per_mm_ = 1 / cell;
    for (int axis = 0; axis < 3; ++axis) size_[axis] = CellAt(high)[axis] + 1;
    Fill(boxes);
  }

  int cells() const { return static_cast<int>(first_.size()) - 1; }
  Eigen::Vector3i CellAt(const Eigen::Vector3d& point) const {
    return ((point - low_) * per_mm_).cast<int>();
  }
  int Index(const Eigen::Vector3i& cell) const {
    return (cell.z() * size_[1] + cell.y()) * size_[0] + cell.x();
  }
  const int* begin(int cell) const { return faces_.data() + first_[cell]; }
  const int* end(int cell) const { return faces_.data() + first_[cell + 1]; }

 private:
  template <typename Visit>
  void VisitCells(const Box& box, const Visit& visit) const {
    const Eigen::Vector3i from = CellAt(box.low), to = CellAt(box.high);
    for (int z = from.z(); z <= to.z(); ++z) {
      for (int y = from.y(); y <= to.y(); ++y) {
        for (int x = from.x(); x <= to.x(); ++x) visit(Index({x, y, z}));
      }
    }
  }

  void Fill(const std::vector<Box>& boxes) {
    first_.assign(static_cast<size_t>(size_[0]) * size_[1] * size_[2] + 1, 0);
    for (const Box& box : boxes) VisitCells(box, [&](int cell) { ++first_[cell + 1]; });
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    faces_.resize(first_.back());
    std::vector<size_t> next(first_.begin(), first_.end() - 1);
    for (size_t f = 0; f < boxes.size(); ++f) {
      VisitCells(boxes[f], [&](int cell) { faces_[next[cell]++] = static_cast<int>(f); });
    }
  }

  Eigen::Vector3d low_;
  double per_mm_ = 0;
  int size_[3] = {};
  std::vector<size_t> first_;  // [cells + 1]
  std::vector<int> faces_;     // ordered within a cell
};

bool ShareVertex(const Face& a, const Face& b) {
  return std::any_of(a.begin(), a.end(), [&](int v) { return v == b[0] || v == b[1] || v == b[2]; });
}

bool Separates(const Eigen::Vector3d& axis, const Eigen::Vector3d (&s)[3], const Eigen::Vector3d (&t)[3]) {
  const double s0 = axis.dot(s[0]), s1 = axis.dot(s[1]), s2 = axis.dot(s[2]);
  const double t0 = axis.dot(t[0]), t1 = axis.dot(t[1]), t2 = axis.dot(t[2]);
  return std::max({s0, s1, s2}) < std::min({t0, t1, t2}) || std::max({t0, t1, t2}) < std::min({s0, s1, s2});
}

}  // namespace

bool TrianglesIntersect(const Eigen::Vector3d (&s)[3], const Eigen::Vector3d (&t)[3]) {
  // Relative to one of the vertices, so that rounding goes with the triangles' size.
  const Eigen::Vector3d p[3] = {Eigen::Vector3d::Zero(), s[1] - s[0], s[2] - s[0]};
  const Eigen::Vector3d q[3] = {t[0] - s[0], t[1] - s[0], t[2] - s[0]};
  const Eigen::Vector3d p_edge[3] = {p[1] - p[0], p[2] - p[1], p[0] - p[2]};
  const Eigen::Vector3d q_edge[3] = {q[1] - q[0], q[2] - q[1], q[0] - q[2]};
  const Eigen::Vector3d p_normal = p_edge[0].cross(p_edge[1]), q_normal = q_edge[0].cross(q_edge[1]);
  if (Separates(p_normal, p, q) || Separates(q_normal, p, q)) return false;
  for (const Eigen::Vector3d& e : p_edge) {
    for (const Eigen::Vector3d& f : q_edge) {
      if (Separates(e.cross(f), p, q)) return false;
    }
  }
  // Within a common plane, and for triangles without area.
  for (const Eigen::Vector3d& e : p_edge) {
    if (Separates(p_normal.cross(e), p, q) || Separates(e, p, q)) return false;
  }
  for (const Eigen::Vector3d& f : q_edge) {
    if (Separates(q_normal.cross(f), p, q) || Separates(f, p, q)) return false;
  }
  return true;
}

std::vector<FacePair> FindSelfIntersections(const std::vector<Eigen::Vector3d>& vertices_mm,
                                            const std::vector<Face>& faces) {
  if (faces.empty()) return {};
  const std::vector<Box> boxes = BoxesOf(vertices_mm, faces);
  const Grid grid(boxes);
  const auto intersect = [&](int a, int b) {
    const Eigen::Vector3d s[3] = {vertices_mm[faces[a][0]], vertices_mm[faces[a][1]],
                                  vertices_mm[faces[a][2]]};
    const Eigen::Vector3d t[3] = {vertices_mm[faces[b][0]], vertices_mm[faces[b][1]],
                                  vertices_mm[faces[b][2]]};
    return TrianglesIntersect(s, t);
  };
  const auto search = [&](int cell, std::vector<FacePair>* found) {
    for (const int* a = grid.begin(cell); a != grid.end(cell); ++a) {
      for (const int* b = a + 1; b != grid.end(cell); ++b) {
        if (!boxes[*a].Overlaps(boxes[*b]) || ShareVertex(faces[*a], faces[*b])) continue;
        // Of the cells that both touch, the one where their overlap begins.
        if (grid.Index(grid.CellAt(boxes[*a].low.cwiseMax(boxes[*b].low))) != cell) continue;
        if (intersect(*a, *b)) found->push_back({*a, *b});
      }
    }
  };
  const int blocks = (grid.cells() + kCellsPerBlock - 1) / kCellsPerBlock;
  std::vector<std::vector<FacePair>> found(blocks);
  tbb::parallel_for(0, blocks, [&](int block) {
    const int last = std::min((block + 1) * kCellsPerBlock, grid.cells());
    for (int cell = block * kCellsPerBlock; cell < last; ++cell) search(cell, &found[block]);
  });
  std::vector<FacePair> pairs;
  for (const auto& some : found) pairs.insert(pairs.end(), some.begin(), some.end());
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace weft
