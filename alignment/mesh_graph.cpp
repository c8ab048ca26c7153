#include "alignment/mesh_graph.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "base/median.h"

namespace weft {
namespace {

struct HalfEdge {
  int a, b;      // a < b
  double cotan;  // of the angle opposite, in one face
};

// Cotangent of the angle at `apex` between the directions to a and b; 0 for triangles without area.
double CotangentAt(const Eigen::Vector3d& apex, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d u = a - apex, v = b - apex;
  const double area = u.cross(v).norm();
  return area > 1e-12 * (u.squaredNorm() + v.squaredNorm()) ? u.dot(v) / area : 0;
}

// Ordered by a, then b, then face.
std::vector<HalfEdge> CollectHalfEdges(const TriangleMesh& mesh) {
  std::vector<size_t> first(mesh.vertices_mm.size() + 1);  // [vertices + 1], of the half-edges of each a
  for (const Face& face : mesh.faces) {
    for (int i = 0; i < 3; ++i) ++first[std::min(face[i], face[(i + 1) % 3]) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<HalfEdge> half_edges(3 * mesh.faces.size());
  std::vector<size_t> next(first.begin(), first.end() - 1);
  for (const Face& face : mesh.faces) {
    for (int i = 0; i < 3; ++i) {
      const int a = face[i], b = face[(i + 1) % 3], apex = face[(i + 2) % 3];
      const double cotan = CotangentAt(mesh.vertices_mm[apex], mesh.vertices_mm[a], mesh.vertices_mm[b]);
      half_edges[next[std::min(a, b)]++] = {std::min(a, b), std::max(a, b), cotan};
    }
  }
  for (size_t v = 0; v + 1 < first.size(); ++v) {
    const auto of_vertex = half_edges.begin() + static_cast<std::ptrdiff_t>(first[v]);
    const auto end = half_edges.begin() + static_cast<std::ptrdiff_t>(first[v + 1]);
    // Few, and already in their faces' order: each goes before those of greater b.
    for (auto edge = of_vertex; edge != end; ++edge) {
      const auto place = std::upper_bound(of_vertex, edge, *edge,
                                          [](const HalfEdge& x, const HalfEdge& y) { return x.b < y.b; });
      std::rotate(place, edge, edge + 1);
    }
  }
  return half_edges;
}

// Edges with half the sum of their one or two cotangents, raised to a floor.
std::vector<double> MergeHalfEdges(const std::vector<HalfEdge>& half_edges, std::vector<MeshEdge>* edges) {
  std::vector<double> weights;
  for (const HalfEdge& h : half_edges) {
    if (edges->empty() || edges->back().a != h.a || edges->back().b != h.b) {
      edges->push_back({h.a, h.b});
      weights.push_back(0);
    }
    weights.back() += 0.5 * h.cotan;
  }
  if (weights.empty()) return weights;
  const double median = Median(weights);
  const double floor = median > 0 ? 0.01 * median : 0.01;
  for (double& w : weights) w = std::max(w, floor);
  return weights;
}

void FillNeighbors(const std::vector<double>& weights, MeshGraph* graph) {
  graph->first.assign(graph->vertices + 1, 0);
  for (const MeshEdge& e : graph->edges) ++graph->first[e.a + 1], ++graph->first[e.b + 1];
  for (int v = 0; v < graph->vertices; ++v) graph->first[v + 1] += graph->first[v];
  graph->neighbor.resize(2 * graph->edges.size());
  graph->cotan_weight.resize(2 * graph->edges.size());
  std::vector<int> next(graph->first.begin(), graph->first.end() - 1);
  const auto add = [&](int from, int to, double weight) {
    graph->neighbor[next[from]] = to;
    graph->cotan_weight[next[from]++] = static_cast<float>(weight);
  };
  // Edges are ordered by (a, b): first every lower neighbour in order, then every higher one.
  for (size_t i = 0; i < graph->edges.size(); ++i) add(graph->edges[i].b, graph->edges[i].a, weights[i]);
  for (size_t i = 0; i < graph->edges.size(); ++i) add(graph->edges[i].a, graph->edges[i].b, weights[i]);
}

void LabelComponents(MeshGraph* graph) {
  graph->component.assign(graph->vertices, -1);
  std::vector<int> stack;
  for (int seed = 0; seed < graph->vertices; ++seed) {
    if (graph->component[seed] >= 0) continue;
    graph->component[seed] = graph->components;
    stack.assign(1, seed);
    while (!stack.empty()) {
      const int v = stack.back();
      stack.pop_back();
      for (int i = graph->first[v]; i < graph->first[v + 1]; ++i) {
        if (graph->component[graph->neighbor[i]] >= 0) continue;
        graph->component[graph->neighbor[i]] = graph->components;
        stack.push_back(graph->neighbor[i]);
      }
    }
    ++graph->components;
  }
}

}  // namespace

MeshGraph BuildMeshGraph(const TriangleMesh& mesh) {
  MeshGraph graph;
  graph.vertices = static_cast<int>(mesh.vertices_mm.size());
  const std::vector<double> weights = MergeHalfEdges(CollectHalfEdges(mesh), &graph.edges);
  FillNeighbors(weights, &graph);
  LabelComponents(&graph);
  return graph;
}

double MeanEdgeMm(const TriangleMesh& mesh, const MeshGraph& graph) {
  double sum = 0;
  for (const MeshEdge& e : graph.edges) sum += (mesh.vertices_mm[e.a] - mesh.vertices_mm[e.b]).norm();
  return graph.edges.empty() ? 0 : sum / graph.edges.size();
}

std::vector<int> RingDistance(const MeshGraph& graph, const std::vector<bool>& is_source) {
  std::vector<int> distance(graph.vertices, -1), front, next;
  for (int v = 0; v < graph.vertices; ++v) {
    if (!is_source[v]) continue;
    distance[v] = 0;
    front.push_back(v);
  }
  for (int ring = 1; !front.empty(); ++ring, front.swap(next)) {
    next.clear();
    for (const int v : front) {
      for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) {
        if (distance[graph.neighbor[i]] >= 0) continue;
        distance[graph.neighbor[i]] = ring;
        next.push_back(graph.neighbor[i]);
      }
    }
  }
  return distance;
}

}  // namespace weft
