#include "alignment/untangle/untangle_push.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "alignment/untangle/closest_points.h"

namespace weft {
namespace {

constexpr int kPushSweeps = 40;
constexpr double kSpread = 0.5;         // pull of a neighbour against that of a full push
constexpr double kAnchor = 1e-3;        // pull of the place where a vertex is
constexpr double kBoundedAnchor = 0.3;  // the same of a bounded vertex
constexpr double kHemAnchor = 0.3;      // pull on the hem of a film, against that of a neighbour
constexpr double kSoftGradient = 0.3;

Eigen::Vector3d NormalOf(const UntanglePatch& patch, int face) {
  const Face& f = patch.faces[face];
  const Eigen::Vector3d& a = patch.position_mm[f[0]];
  return (patch.position_mm[f[1]] - a).cross(patch.position_mm[f[2]] - a).normalized();
}

// Without the vertices that have no way to others than these.
std::vector<int> Bordered(const UntanglePatch& patch, const std::vector<int>& vertices) {
  std::vector<bool> among(patch.vertex.size(), false), bordered(patch.vertex.size(), false);
  for (const int v : vertices) among[v] = true;
  std::vector<int> front;
  for (const int v : vertices) {
    const std::span<const int> neighbors = patch.NeighborsOf(v);
    if (std::all_of(neighbors.begin(), neighbors.end(), [&](int w) { return among[w]; })) continue;
    bordered[v] = true;
    front.push_back(v);
  }
  while (!front.empty()) {
    const int v = front.back();
    front.pop_back();
    for (const int w : patch.NeighborsOf(v)) {
      if (!among[w] || bordered[w]) continue;
      bordered[w] = true;
      front.push_back(w);
    }
  }
  std::vector<int> some;
  std::copy_if(vertices.begin(), vertices.end(), std::back_inserter(some),
               [&](int v) { return bordered[v]; });
  return some;
}

struct Layer {
  std::vector<int> faces;
  std::vector<Eigen::Vector3d> middle;
  std::vector<double> radius;
};

// Faces around those opposite to the region, as far as the region is wide, but none of its own.
Layer LayerOpposite(const UntanglePatch& patch, const CutOffRegion& region) {
  std::vector<bool> own(patch.vertex.size(), false), taken(patch.faces.size(), false);
  for (const int v : region.vertices) own[v] = true;
  std::vector<int> front;
  Layer layer;
  const auto take = [&](int f) {
    const Face& face = patch.faces[f];
    if (taken[f] || own[face[0]] || own[face[1]] || own[face[2]]) return;
    taken[f] = true;
    front.push_back(f);
    layer.faces.push_back(f);
  };
  for (const int f : region.opposite) take(f);
  const int rings = 2 + static_cast<int>(std::sqrt(static_cast<double>(region.vertices.size())));
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<int> last = std::move(front);
    front.clear();
    for (const int f : last) {
      for (const int v : patch.faces[f]) {
        for (const int g : patch.FacesOf(v)) take(g);
      }
    }
  }
  for (const int f : layer.faces) {
    const Face& face = patch.faces[f];
    const Eigen::Vector3d &a = patch.position_mm[face[0]], &b = patch.position_mm[face[1]],
                          &c = patch.position_mm[face[2]];
    layer.middle.push_back((a + b + c) / 3);
    const Eigen::Vector3d& m = layer.middle.back();
    layer.radius.push_back(
        std::sqrt(std::max({(a - m).squaredNorm(), (b - m).squaredNorm(), (c - m).squaredNorm()})));
  }
  return layer;
}

struct PointOnFace {
  int face = -1;
  Eigen::Vector3d shares = Eigen::Vector3d::Zero(), position_mm = Eigen::Vector3d::Zero();
};

PointOnFace ClosestOn(const UntanglePatch& patch, const Layer& layer, const Eigen::Vector3d& p) {
  PointOnFace closest;
  double best = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < layer.faces.size(); ++i) {
    const double reach = best + layer.radius[i];
    if ((layer.middle[i] - p).squaredNorm() > reach * reach) continue;
    const Face& face = patch.faces[layer.faces[i]];
    const Eigen::Vector3d &a = patch.position_mm[face[0]], &b = patch.position_mm[face[1]],
                          &c = patch.position_mm[face[2]];
    const Eigen::Vector3d shares = ClosestOnTriangle(p, a, b, c);
    const Eigen::Vector3d point = shares[0] * a + shares[1] * b + shares[2] * c;
    const double distance = (point - p).norm();
    if (distance < best) {
      best = distance;
      closest = {layer.faces[i], shares, point};
    }
  }
  return closest;
}

}  // namespace

std::vector<int> GrownInPatch(const UntanglePatch& patch, const std::vector<int>& vertices, int rings) {
  std::vector<bool> reached(patch.free, false);
  std::vector<int> all, front;
  const auto reach = [&](int v) {
    if (v >= patch.free || reached[v]) return;
    reached[v] = true;
    all.push_back(v);
    front.push_back(v);
  };
  for (const int v : vertices) reach(v);
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<int> last = std::move(front);
    front.clear();
    for (const int v : last) {
      for (const int w : patch.NeighborsOf(v)) reach(w);
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

PushField::PushField(const UntanglePatch& patch)
    : patch_(patch), sum_(patch.free, Eigen::Vector3d::Zero()), weight_(patch.free, 0) {}

void PushField::Part(const std::vector<Corner>& corners, const Eigen::Vector3d& move) {
  double mobility = 0;
  for (const Corner& c : corners) {
    if (c.vertex < patch_.free) mobility += c.share * c.share / patch_.weight[c.vertex];
  }
  if (!(mobility > 1e-9)) return;
  for (const Corner& c : corners) {
    if (c.vertex >= patch_.free) continue;
    const double weight = std::abs(c.share);
    sum_[c.vertex] += weight * c.share / (patch_.weight[c.vertex] * mobility) * move;
    weight_[c.vertex] += weight;
  }
}

void PushField::Apply(UntanglePatch* patch) const {
  std::vector<Eigen::Vector3d> move(patch->vertex.size(), Eigen::Vector3d::Zero());
  std::vector<double> pull(patch->free);
  std::vector<Eigen::Vector3d> asked(patch->free, Eigen::Vector3d::Zero());
  for (int v = 0; v < patch->free; ++v) {
    if (weight_[v] < 1e-9) continue;
    pull[v] = std::min(1.0, weight_[v]);
    move[v] = sum_[v] / weight_[v];
    asked[v] = pull[v] * move[v];
  }
  for (int sweep = 0; sweep < kPushSweeps; ++sweep) {
    for (int i = 0; i < patch->free; ++i) {
      const int v = sweep % 2 == 0 ? i : patch->free - 1 - i;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const int w : patch->NeighborsOf(v)) sum += move[w];
      const double degree = static_cast<double>(patch->NeighborsOf(v).size());
      const double anchor = patch->IsBounded(v) ? kBoundedAnchor : kAnchor;
      move[v] = (asked[v] + kSpread * sum) / (pull[v] + kSpread * degree + anchor);
    }
  }
  for (int v = 0; v < patch->free; ++v) {
    const Eigen::Vector3d way = patch->position_mm[v] + move[v] - patch->observed_mm[v];
    const double share = std::min(1.0, patch->MostWayMm(v) / std::max(way.norm(), 1e-12));
    patch->position_mm[v] = patch->observed_mm[v] + share * way;
  }
}

void PushRegion(const UntanglePatch& patch, const CutOffRegion& region, double gap_mm, PushField* field) {
  const Layer layer = LayerOpposite(patch, region);
  for (const int v : region.vertices) {
    const PointOnFace closest = ClosestOn(patch, layer, patch.position_mm[v]);
    if (closest.face < 0) return;
    const Eigen::Vector3d way = closest.position_mm - patch.position_mm[v];
    const double distance = way.norm();
    if (distance < 1e-9) continue;
    const Face& face = patch.faces[closest.face];
    field->Part(
        {{v, 1}, {face[0], -closest.shares[0]}, {face[1], -closest.shares[1]}, {face[2], -closest.shares[2]}},
        way * (1 + gap_mm / distance));
  }
}

void ShortenContour(const UntanglePatch& patch, const Piercing& piercing, double step_mm, PushField* field) {
  const PatchEdge& edge = patch.edges[piercing.edge];
  const Eigen::Vector3d& from = patch.position_mm[edge.a];
  const Eigen::Vector3d along = (patch.position_mm[edge.b] - from).normalized();
  const Eigen::Vector3d normal = NormalOf(patch, piercing.face);
  const double slope = along.dot(normal);
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const int f : edge.face) {
    if (f < 0) continue;
    // The contour's direction on this side of the edge.
    Eigen::Vector3d contour = normal.cross(NormalOf(patch, f));
    if (contour.norm() < 1e-9) continue;
    contour.normalize();
    Eigen::Vector3d inward = Eigen::Vector3d::Zero();
    for (const int v : patch.faces[f]) inward += patch.position_mm[v] - from;
    if (contour.dot(inward - along * along.dot(inward)) < 0) contour = -contour;
    gradient +=
        contour - 2 * along.dot(contour) / std::copysign(std::max(std::abs(slope), 1e-3), slope) * normal;
  }
  const Eigen::Vector3d point = piercing.PointOn(patch);
  const Face& face = patch.faces[piercing.face];
  const Eigen::Vector3d shares = ClosestOnTriangle(point, patch.position_mm[face[0]],
                                                   patch.position_mm[face[1]], patch.position_mm[face[2]]);
  field->Part({{edge.a, 1 - piercing.at},
               {edge.b, piercing.at},
               {face[0], -shares[0]},
               {face[1], -shares[1]},
               {face[2], -shares[2]}},
              gradient * (step_mm / std::hypot(gradient.norm(), kSoftGradient)));
}

void Flatten(const std::vector<int>& vertices, int rings, UntanglePatch* patch) {
  std::vector<int> grown = GrownInPatch(*patch, vertices, rings);
  std::erase_if(grown, [&](int v) { return patch->IsBounded(v); });
  const std::vector<int> some = Bordered(*patch, grown);
  if (some.empty()) return;
  std::vector<int> index(patch->vertex.size(), -1);
  for (size_t i = 0; i < some.size(); ++i) index[some[i]] = static_cast<int>(i);
  Eigen::SparseMatrix<double> laplacian(some.size(), some.size());
  laplacian.reserve(Eigen::VectorXi::Constant(some.size(), 8));
  // A film that ends within the patch would shrink.
  std::vector<double> anchor(patch->vertex.size(), 0);
  for (const PatchEdge& edge : patch->edges) {
    if (edge.face[1] < 0) anchor[edge.a] = anchor[edge.b] = kHemAnchor;
  }
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(some.size(), 3);
  for (size_t i = 0; i < some.size(); ++i) {
    double diagonal = anchor[some[i]];
    right.row(i) = diagonal * patch->position_mm[some[i]].transpose();
    for (const int w : patch->NeighborsOf(some[i])) {
      diagonal += 1;
      if (index[w] < 0) {
        right.row(i) += patch->position_mm[w].transpose();
      } else if (index[w] > static_cast<int>(i)) {
        laplacian.insert(index[w], i) = -1;
      }
    }
    laplacian.insert(i, i) = diagonal;
  }
  laplacian.makeCompressed();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(laplacian);
  if (factor.info() != Eigen::Success) return;
  const Eigen::MatrixX3d solution = factor.solve(right);
  for (size_t i = 0; i < some.size(); ++i) patch->position_mm[some[i]] = solution.row(i);
}

}  // namespace weft
