#include "alignment/untangle/cut_off_regions.h"

#include <algorithm>
#include <array>

#include "alignment/untangle/face_grid.h"
#include "alignment/untangle/self_intersection.h"

namespace weft {
namespace {

constexpr double kLoopShare = 0.25;  // of the faces opposite a region: with so many of its own it is a loop
constexpr int kUnseen = -1, kBarrier = -2;

bool HasFreeVertex(const UntanglePatch& patch, const Face& face) {
  return face[0] < patch.free || face[1] < patch.free || face[2] < patch.free;
}

// Piercings of one face by the edges that another one owns (each edge is owned by the first of its faces).
void Pierce(const UntanglePatch& patch, int edges_of, int face, std::vector<Piercing>* found) {
  const Face& f = patch.faces[face];
  for (const int e : patch.edges_of_face[edges_of]) {
    const PatchEdge& edge = patch.edges[e];
    if (edge.face[0] != edges_of) continue;
    if (std::any_of(f.begin(), f.end(), [&](int v) { return v == edge.a || v == edge.b; })) continue;
    const Eigen::Vector3d corners[3] = {patch.position_mm[f[0]], patch.position_mm[f[1]],
                                        patch.position_mm[f[2]]};
    const auto at = SegmentThroughTriangle(patch.position_mm[edge.a], patch.position_mm[edge.b], corners);
    if (at) found->push_back({e, face, *at});
  }
}

// Vertices where a contour begins or ends: two faces around them pass through each other.
std::vector<int> LoopVertices(const UntanglePatch& patch, const std::vector<Piercing>& piercings) {
  std::vector<int> vertices;
  for (const Piercing& piercing : piercings) {
    for (const int f : patch.edges[piercing.edge].face) {
      if (f < 0) continue;
      for (const int v : patch.faces[f]) {
        const Face& other = patch.faces[piercing.face];
        if (v == other[0] || v == other[1] || v == other[2]) vertices.push_back(v);
      }
    }
  }
  return vertices;
}

// Labels of the pieces into which the cut edges and the barriers divide the free vertices.
class Pieces {
 public:
  Pieces(const UntanglePatch& patch, const std::vector<Piercing>& piercings)
      : patch_(patch), label_(patch.free, kUnseen) {
    for (const Piercing& piercing : piercings) {
      const PatchEdge& edge = patch.edges[piercing.edge];
      cut_.push_back({edge.a, edge.b});
    }
    cut_.erase(std::unique(cut_.begin(), cut_.end()), cut_.end());  // piercings are ordered by edge
    cut_at_.assign(patch.vertex.size(), false);
    for (const auto& [a, b] : cut_) cut_at_[a] = cut_at_[b] = true;
    for (const int v : LoopVertices(patch, piercings)) {
      if (v < patch.free) label_[v] = kBarrier;
    }
    for (int v = 0; v < patch.free; ++v) {
      if (label_[v] == kUnseen) Flood(v);
    }
    SetOutside();
  }

  int LabelOf(int v) const { return v < patch_.free ? label_[v] : kUnseen; }
  // Whether the piece is cut off from the rest.
  bool IsInside(int label) const { return label >= 0 && !outside_[label]; }
  int count() const { return static_cast<int>(size_.size()); }

 private:
  bool IsCut(int v, int w) const {
    return cut_at_[v] && cut_at_[w] &&
           std::binary_search(cut_.begin(), cut_.end(), std::array{std::min(v, w), std::max(v, w)});
  }

  void Flood(int start) {
    const int label = count();
    size_.push_back(0);
    outside_.push_back(false);
    std::vector<int> front = {start};
    label_[start] = label;
    while (!front.empty()) {
      const int v = front.back();
      front.pop_back();
      ++size_[label];
      for (const int w : patch_.NeighborsOf(v)) {
        if (IsCut(v, w)) continue;
        if (w >= patch_.free) {
          outside_[label] = true;
        } else if (label_[w] == kUnseen) {
          label_[w] = label;
          front.push_back(w);
        }
      }
    }
  }

  // Of the pieces of a sheet that ends within the patch the largest one is its outside.
  void SetOutside() {
    std::vector<bool> seen(patch_.free, false);
    for (int start = 0; start < patch_.free; ++start) {
      if (seen[start]) continue;
      bool anchored = false;
      int largest = kUnseen;
      std::vector<int> front = {start};
      seen[start] = true;
      while (!front.empty()) {
        const int v = front.back();
        front.pop_back();
        const int label = label_[v];
        if (label >= 0 && (largest < 0 || size_[label] > size_[largest])) largest = label;
        for (const int w : patch_.NeighborsOf(v)) {
          if (w >= patch_.free) {
            anchored = true;
          } else if (!seen[w]) {
            seen[w] = true;
            front.push_back(w);
          }
        }
      }
      if (!anchored && largest >= 0) outside_[largest] = true;
    }
  }

  const UntanglePatch& patch_;
  std::vector<std::array<int, 2>> cut_;  // ordered
  std::vector<bool> cut_at_;             // [n], whether an edge of the vertex is cut
  std::vector<int> label_;               // [free]
  std::vector<int> size_;                // [pieces]
  std::vector<bool> outside_;            // [pieces]
};

}  // namespace

std::vector<Piercing> FindPiercings(const UntanglePatch& patch) {
  const FaceGrid grid(patch.position_mm, patch.faces, 0);
  std::vector<Piercing> found;
  grid.VisitPairs(0, grid.cells(), [&](int a, int b) {
    if (!HasFreeVertex(patch, patch.faces[a]) && !HasFreeVertex(patch, patch.faces[b])) return;
    Pierce(patch, a, b, &found);
    Pierce(patch, b, a, &found);
  });
  std::sort(found.begin(), found.end(), [](const Piercing& p, const Piercing& q) {
    return p.edge != q.edge ? p.edge < q.edge : p.face < q.face;
  });
  return found;
}

CutOffRegions FindRegions(const UntanglePatch& patch, const std::vector<Piercing>& piercings) {
  const Pieces pieces(patch, piercings);
  std::vector<CutOffRegion> regions(pieces.count());
  std::vector<int> own(pieces.count());  // opposite faces that are the region's own
  CutOffRegions result;
  for (const Piercing& piercing : piercings) {
    const PatchEdge& edge = patch.edges[piercing.edge];
    const int a = pieces.LabelOf(edge.a), b = pieces.LabelOf(edge.b);
    bool explained = false;
    const auto has = [&](int label) {
      const Face& f = patch.faces[piercing.face];
      return std::any_of(f.begin(), f.end(), [&](int v) { return pieces.LabelOf(v) == label; });
    };
    for (const int label : {a, b}) {
      if (!pieces.IsInside(label)) continue;
      explained = true;
      if (a == b) continue;
      regions[label].opposite.push_back(piercing.face);
      own[label] += has(label);
    }
    for (const int v : patch.faces[piercing.face]) explained |= pieces.IsInside(pieces.LabelOf(v));
    result.explained.push_back(explained);
  }
  for (int v = 0; v < patch.free; ++v) {
    if (pieces.IsInside(pieces.LabelOf(v))) regions[pieces.LabelOf(v)].vertices.push_back(v);
  }
  for (int label = 0; label < pieces.count(); ++label) {
    CutOffRegion& region = regions[label];
    if (region.vertices.empty() || region.opposite.empty()) continue;
    region.loop = own[label] > kLoopShare * static_cast<double>(region.opposite.size());
    std::sort(region.opposite.begin(), region.opposite.end());
    region.opposite.erase(std::unique(region.opposite.begin(), region.opposite.end()), region.opposite.end());
    result.regions.push_back(std::move(region));
  }
  return result;
}

}  // namespace weft
