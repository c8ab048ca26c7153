#include "alignment/template_build/mesh_topology.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

struct DirectedEdge {
  int from, to, face;
  bool operator<(const DirectedEdge& other) const {
    return std::tie(from, to, face) < std::tie(other.from, other.to, other.face);
  }
};

std::vector<DirectedEdge> SortedDirectedEdges(const std::vector<Face>& faces) {
  std::vector<DirectedEdge> directed_edges;
  directed_edges.reserve(3 * faces.size());
  for (size_t f = 0; f < faces.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      directed_edges.push_back({faces[f][i], faces[f][(i + 1) % 3], static_cast<int>(f)});
    }
  }
  std::sort(directed_edges.begin(), directed_edges.end());
  return directed_edges;
}

int FindRoot(std::vector<int>* parent, int v) {
  while ((*parent)[v] != v) v = (*parent)[v] = (*parent)[(*parent)[v]];
  return v;
}

// Each vertex with faces must have one fan: as many groups of faces joined at edges around it as vertices.
absl::Status CheckFans(int vertices, const std::vector<Face>& faces, const std::vector<int>& borders_from) {
  std::vector<int> first(vertices + 1, 0);
  for (const Face& face : faces) {
    for (const int v : face) ++first[v + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::pair<int, int>> spokes(
      first.back());  // of the faces at a vertex: next and previous corner
  std::vector<int> filled(first.begin(), first.end() - 1);
  for (const Face& face : faces) {
    for (int i = 0; i < 3; ++i) spokes[filled[face[i]]++] = {face[(i + 1) % 3], face[(i + 2) % 3]};
  }
  for (int v = 0; v < vertices; ++v) {
    const int degree = first[v + 1] - first[v];
    if (degree == 0) continue;
    // Walk from the border, or from anywhere when there is none.
    int next = borders_from[v] >= 0 ? borders_from[v] : spokes[first[v]].first, walked = 0;
    for (; walked < degree; ++walked) {
      const auto spoke = std::find_if(spokes.begin() + first[v], spokes.begin() + first[v + 1],
                                      [&](const auto& s) { return s.first == next; });
      if (spoke == spokes.begin() + first[v + 1]) break;
      next = spoke->second;
      if (borders_from[v] < 0 && next == spokes[first[v]].first) {
        ++walked;
        break;
      }
    }
    if (walked != degree) {
      return absl::FailedPreconditionError(
          absl::StrCat("vertex ", v, ": pieces of the surface merely touch there"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MeshTopology> CheckTopology(int vertices, const std::vector<Face>& faces) {
  const std::vector<DirectedEdge> directed_edges = SortedDirectedEdges(faces);
  std::vector<int> border_to(vertices, -1);
  MeshTopology topology;
  int borders = 0;
  for (size_t i = 0; i < directed_edges.size(); ++i) {
    const auto [from, to, face] = directed_edges[i];
    if (i > 0 && directed_edges[i - 1].from == from && directed_edges[i - 1].to == to) {
      return absl::FailedPreconditionError(absl::StrCat("edge from vertex ", from, " to ", to, ": faces ",
                                                        directed_edges[i - 1].face, " and ", face,
                                                        " run through it in the same sense"));
    }
    const DirectedEdge back{to, from, -1};
    const auto other = std::lower_bound(directed_edges.begin(), directed_edges.end(), back);
    if (other != directed_edges.end() && other->from == to && other->to == from) continue;
    if (border_to[from] >= 0) {
      return absl::FailedPreconditionError(
          absl::StrCat("vertex ", from, ": pieces of the surface merely touch there"));
    }
    border_to[from] = to;
    ++borders;
  }
  WEFT_RETURN_IF_ERROR(CheckFans(vertices, faces, border_to));
  topology.edges = (static_cast<int>(directed_edges.size()) + borders) / 2;

  std::vector<int> parent(vertices);
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<bool> used(vertices, false);
  for (const Face& face : faces) {
    for (int i = 0; i < 3; ++i) {
      used[face[i]] = true;
      parent[FindRoot(&parent, face[i])] = FindRoot(&parent, face[0]);
    }
  }
  int used_vertices = 0;
  for (int v = 0; v < vertices; ++v) {
    used_vertices += used[v];
    topology.components += used[v] && parent[v] == v;
  }
  std::vector<bool> walked(vertices, false);
  for (int v = 0; v < vertices; ++v) {
    if (border_to[v] < 0 || walked[v]) continue;
    topology.loops.emplace_back();
    for (int at = v; !walked[at]; at = border_to[at]) {
      walked[at] = true;
      topology.loops.back().push_back(at);
    }
  }
  topology.euler = used_vertices - topology.edges + static_cast<int>(faces.size());
  topology.genus = (2 * topology.components - topology.euler - static_cast<int>(topology.loops.size())) / 2;
  return topology;
}

double LoopLengthMm(const std::vector<int>& loop, const std::vector<Eigen::Vector3d>& vertices_mm) {
  double length_mm = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    length_mm += (vertices_mm[loop[(i + 1) % loop.size()]] - vertices_mm[loop[i]]).norm();
  }
  return length_mm;
}

}  // namespace weft
