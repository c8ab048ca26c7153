#include "alignment/untangle/untangle_patch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace weft {
namespace {

constexpr double kLeastWeight = 0.02, kMostWeight = 50;
constexpr double kMeasuredFactor = 1000;  // of the weight: others move around a measured vertex

class DisjointSets {
 public:
  explicit DisjointSets(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int Find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(int a, int b) {
    a = Find(a), b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

// Cells of space near some points.
class Neighborhood {
 public:
  Neighborhood(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<int>& some, double reach_mm)
      : low_(vertices_mm[some[0]]), high_(low_), cell_mm_(reach_mm) {
    for (const int v : some) {
      low_ = low_.cwiseMin(vertices_mm[v]);
      high_ = high_.cwiseMax(vertices_mm[v]);
    }
    low_.array() -= reach_mm;
    high_.array() += reach_mm;
    while (((high_ - low_) / cell_mm_).prod() > 1e6) cell_mm_ *= 1.5;
    for (int axis = 0; axis < 3; ++axis) {
      size_[axis] = static_cast<int>((high_[axis] - low_[axis]) / cell_mm_) + 1;
    }
    marked_.assign(static_cast<size_t>(size_[0]) * size_[1] * size_[2], false);
    for (const int v : some) Mark(CellAt(vertices_mm[v]));
  }

  bool Holds(const Eigen::Vector3d& point) const {
    if ((point.array() < low_.array()).any() || (point.array() > high_.array()).any()) return false;
    return marked_[Index(CellAt(point))];
  }

 private:
  Eigen::Vector3i CellAt(const Eigen::Vector3d& point) const {
    return ((point - low_) / cell_mm_).cast<int>();
  }
  size_t Index(const Eigen::Vector3i& cell) const {
    return (static_cast<size_t>(cell.z()) * size_[1] + cell.y()) * size_[0] + cell.x();
  }
  void Mark(const Eigen::Vector3i& cell) {
    for (int z = std::max(cell.z() - 1, 0); z <= std::min(cell.z() + 1, size_[2] - 1); ++z) {
      for (int y = std::max(cell.y() - 1, 0); y <= std::min(cell.y() + 1, size_[1] - 1); ++y) {
        for (int x = std::max(cell.x() - 1, 0); x <= std::min(cell.x() + 1, size_[0] - 1); ++x) {
          marked_[Index({x, y, z})] = true;
        }
      }
    }
  }

  Eigen::Vector3d low_, high_;
  double cell_mm_;
  int size_[3] = {};
  std::vector<bool> marked_;
};

// Faces with a free vertex, and fixed ones near them.
std::vector<Face> FacesNear(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces,
                            const std::vector<int>& free, double reach_mm) {
  const Neighborhood near(vertices_mm, free, reach_mm);
  std::vector<bool> inside(vertices_mm.size());
  for (size_t v = 0; v < vertices_mm.size(); ++v) inside[v] = near.Holds(vertices_mm[v]);
  std::vector<Face> some;
  for (const Face& face : faces) {
    if (inside[face[0]] || inside[face[1]] || inside[face[2]]) some.push_back(face);
  }
  return some;
}

// From the mesh's numbers to the patch's.
void Renumber(const std::vector<int>& free, UntanglePatch* patch) {
  patch->vertex = free;
  patch->free = static_cast<int>(free.size());
  for (const Face& face : patch->faces) {
    for (const int v : face) {
      if (!std::binary_search(free.begin(), free.end(), v)) patch->vertex.push_back(v);
    }
  }
  const auto fixed = patch->vertex.begin() + patch->free;
  std::sort(fixed, patch->vertex.end());
  patch->vertex.erase(std::unique(fixed, patch->vertex.end()), patch->vertex.end());
  const auto number = [&](int v) {
    const auto middle = patch->vertex.begin() + patch->free;
    auto at = std::lower_bound(patch->vertex.begin(), middle, v);
    if (at == middle || *at != v) at = std::lower_bound(middle, patch->vertex.end(), v);
    return static_cast<int>(at - patch->vertex.begin());
  };
  for (Face& face : patch->faces) face = {number(face[0]), number(face[1]), number(face[2])};
}

void SetEdges(UntanglePatch* patch) {
  struct Side {
    int a, b, face, side;
    auto operator<=>(const Side&) const = default;
  };
  std::vector<Side> sides;
  for (int f = 0; f < static_cast<int>(patch->faces.size()); ++f) {
    for (int i = 0; i < 3; ++i) {
      const int a = patch->faces[f][i], b = patch->faces[f][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), f, i});
    }
  }
  std::sort(sides.begin(), sides.end());
  patch->edges_of_face.resize(patch->faces.size());
  for (const Side& side : sides) {
    if (patch->edges.empty() || patch->edges.back().a != side.a || patch->edges.back().b != side.b) {
      patch->edges.push_back({side.a, side.b, {side.face, -1}});
    } else {
      patch->edges.back().face[1] = side.face;
    }
    patch->edges_of_face[side.face][side.side] = static_cast<int>(patch->edges.size()) - 1;
  }
}

void SetNeighbors(UntanglePatch* patch) {
  std::vector<std::vector<int>> neighbors(patch->free);
  for (const PatchEdge& edge : patch->edges) {
    if (edge.a < patch->free) neighbors[edge.a].push_back(edge.b);
    if (edge.b < patch->free) neighbors[edge.b].push_back(edge.a);
  }
  patch->neighbor_first = {0};
  for (const std::vector<int>& some : neighbors) {
    patch->neighbor.insert(patch->neighbor.end(), some.begin(), some.end());
    patch->neighbor_first.push_back(static_cast<int>(patch->neighbor.size()));
  }
  FacesOfVertex around(static_cast<int>(patch->vertex.size()), patch->faces);
  patch->face_first = std::move(around.first);
  patch->face_of = std::move(around.face);
}

void SetWeights(std::span<const float> sigma_mm, UntanglePatch* patch) {
  patch->weight.assign(patch->vertex.size(), 1);
  if (sigma_mm.empty()) return;
  double sum = 0;
  for (int v = 0; v < patch->free; ++v) {
    const double sigma = sigma_mm[patch->vertex[v]];
    sum += patch->weight[v] = 1 / (sigma * sigma);
  }
  for (int v = 0; v < patch->free; ++v) {
    patch->weight[v] = std::clamp(patch->weight[v] * patch->free / sum, kLeastWeight, kMostWeight);
  }
}

void SetBounds(std::span<const double> bound_mm, UntanglePatch* patch) {
  patch->bound_mm.assign(patch->vertex.size(), std::numeric_limits<double>::infinity());
  patch->released.assign(patch->vertex.size(), false);
  if (bound_mm.empty()) return;
  for (int v = 0; v < patch->free; ++v) {
    patch->bound_mm[v] = bound_mm[patch->vertex[v]];
    if (patch->IsMeasured(v)) patch->weight[v] *= kMeasuredFactor;
  }
}

}  // namespace

FacesOfVertex::FacesOfVertex(int vertices, const std::vector<Face>& faces)
    : first(vertices + 1), face(3 * faces.size()) {
  for (const Face& f : faces) {
    for (const int v : f) ++first[v + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<int> next(first.begin(), first.end() - 1);
  for (size_t f = 0; f < faces.size(); ++f) {
    for (const int v : faces[f]) face[next[v]++] = static_cast<int>(f);
  }
}

std::vector<std::vector<int>> GrowGroups(const std::vector<Face>& faces, const FacesOfVertex& around,
                                         const std::vector<std::vector<int>>& groups, int rings) {
  const int vertices = around.vertices();
  std::vector<int> label(vertices, -1);
  DisjointSets sets(static_cast<int>(groups.size()));
  std::vector<int> front, reached;
  const auto reach = [&](int v, int group) {
    if (label[v] < 0) {
      label[v] = group;
      front.push_back(v);
      reached.push_back(v);
    } else {
      sets.Join(label[v], group);
    }
  };
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const int v : groups[g]) reach(v, static_cast<int>(g));
  }
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<int> last = std::move(front);
    front.clear();
    for (const int v : last) {
      for (const int f : around.of(v)) {
        for (const int w : faces[f]) reach(w, label[v]);
      }
    }
  }
  std::sort(reached.begin(), reached.end());
  std::vector<std::vector<int>> grown(groups.size());
  for (const int v : reached) grown[sets.Find(label[v])].push_back(v);
  std::erase_if(grown, [](const auto& group) { return group.empty(); });
  std::sort(grown.begin(), grown.end());
  return grown;
}

UntanglePatch CutPatch(const std::vector<Eigen::Vector3d>& observed_mm,
                       const std::vector<Eigen::Vector3d>& position_mm, const std::vector<Face>& faces,
                       std::span<const float> sigma_mm, std::span<const double> bound_mm,
                       const std::vector<int>& free, double reach_mm) {
  UntanglePatch patch;
  patch.faces = FacesNear(position_mm, faces, free, reach_mm);
  Renumber(free, &patch);
  SetEdges(&patch);
  SetNeighbors(&patch);
  for (const int v : patch.vertex) {
    patch.observed_mm.push_back(observed_mm[v]);
    patch.position_mm.push_back(position_mm[v]);
  }
  SetWeights(sigma_mm, &patch);
  SetBounds(bound_mm, &patch);
  return patch;
}

}  // namespace weft
