#include "alignment/untangle/self_intersection.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "alignment/untangle/face_grid.h"

namespace weft {
namespace {

constexpr int kCellsPerBlock = 1 << 14;
constexpr double kCoordinateRounding = 2.5e-7;  // two points come closer by this share of their coordinates

constexpr double kParallel = 1e-10;  // sine of the angle below which a segment lies in a plane

using Triangle = Eigen::Vector3d[3];

void SetCorners(const std::vector<Eigen::Vector3d>& vertices_mm, const Face& face, Triangle& corners) {
  for (int i = 0; i < 3; ++i) corners[i] = vertices_mm[face[i]];
}

void RoundToFloat(Triangle& corners) {
  for (Eigen::Vector3d& corner : corners) corner = corner.cast<float>().cast<double>();
}

int SharedVertices(const Face& a, const Face& b) {
  int shared = 0;
  for (const int v : a) shared += v == b[0] || v == b[1] || v == b[2];
  return shared;
}

// Whether the triangles are further apart than margin_mm along the axis.
bool Separates(const Eigen::Vector3d& axis, const Triangle& s, const Triangle& t, double margin_mm) {
  const double s0 = axis.dot(s[0]), s1 = axis.dot(s[1]), s2 = axis.dot(s[2]);
  const double t0 = axis.dot(t[0]), t1 = axis.dot(t[1]), t2 = axis.dot(t[2]);
  const double gap = std::max(std::min({t0, t1, t2}) - std::max({s0, s1, s2}),
                              std::min({s0, s1, s2}) - std::max({t0, t1, t2}));
  return gap > 0 && gap * gap > margin_mm * margin_mm * axis.squaredNorm();
}

bool ComeWithin(double margin_mm, const Triangle& s, const Triangle& t) {
  // Relative to one of the vertices, so that rounding goes with the triangles' size.
  const Triangle p = {Eigen::Vector3d::Zero(), s[1] - s[0], s[2] - s[0]};
  const Triangle q = {t[0] - s[0], t[1] - s[0], t[2] - s[0]};
  const Triangle p_edge = {p[1] - p[0], p[2] - p[1], p[0] - p[2]};
  const Triangle q_edge = {q[1] - q[0], q[2] - q[1], q[0] - q[2]};
  const Eigen::Vector3d p_normal = p_edge[0].cross(p_edge[1]), q_normal = q_edge[0].cross(q_edge[1]);
  const auto separates = [&](const Eigen::Vector3d& axis) { return Separates(axis, p, q, margin_mm); };
  if (separates(p_normal) || separates(q_normal)) return false;
  for (const Eigen::Vector3d& e : p_edge) {
    for (const Eigen::Vector3d& f : q_edge) {
      if (separates(e.cross(f))) return false;
    }
  }
  // Within a common plane, and for triangles without area.
  for (const Eigen::Vector3d& e : p_edge) {
    if (separates(p_normal.cross(e)) || separates(e)) return false;
  }
  for (const Eigen::Vector3d& f : q_edge) {
    if (separates(q_normal.cross(f)) || separates(f)) return false;
  }
  return true;
}

// Turns the corners, order kept, so that the vertex that both faces have comes first.
void StartAtSharedVertex(Face& a, Face& b) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (a[i] != b[j]) continue;
      std::rotate(a.begin(), a.begin() + i, a.end());
      std::rotate(b.begin(), b.begin() + j, b.end());
      return;
    }
  }
}

// For triangles with the same first corner: whether they surely meet nowhere else, seen in the plane of one
// of them.
bool PointApart(const Triangle& s, const Triangle& t) {
  const Eigen::Vector3d a = s[1] - s[0], b = s[2] - s[0], c = t[1] - t[0], d = t[2] - t[0];
  const double margin = -1e-6 * (c.squaredNorm() + d.squaredNorm());
  const Eigen::Vector3d middle = c + d;
  if (c.dot(middle) > 0 && d.dot(middle) > 0 && a.dot(middle) < margin && b.dot(middle) < margin) return true;
  const Eigen::Vector3d normal = c.cross(d), beside_c = normal.cross(c), beside_d = d.cross(normal);
  const double area = margin * normal.norm();
  return (a.dot(beside_c) < area && b.dot(beside_c) < area) ||
         (a.dot(beside_d) < area && b.dot(beside_d) < area);
}

// A ray from the corner that both have leaves each of them through the side opposite.
bool MeetBesidesFirstCorner(const Triangle& s, const Triangle& t) {
  return ComeWithin(0, {s[1], s[2], s[2]}, t) || ComeWithin(0, s, {t[1], t[2], t[2]});
}

// The pairs of faces near each other for which `accept`, ordered. `of` ([faces], or null for all): those with
// one of these faces.
template <typename Accept>
std::vector<FacePair> FindPairs(const FaceGrid& grid, const std::vector<bool>* of, const Accept& accept) {
  const int blocks = (grid.cells() + kCellsPerBlock - 1) / kCellsPerBlock;
  std::vector<std::vector<FacePair>> found(blocks);
  tbb::parallel_for(0, blocks, [&](int block) {
    const int first = block * kCellsPerBlock, last = std::min(first + kCellsPerBlock, grid.cells());
    const auto visit = [&](int a, int b) {
      if (accept(a, b)) found[block].push_back({a, b});
    };
    of != nullptr ? grid.VisitPairsOf(*of, first, last, visit) : grid.VisitPairs(first, last, visit);
  });
  std::vector<FacePair> pairs;
  for (const auto& some : found) pairs.insert(pairs.end(), some.begin(), some.end());
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

// The pairs that FindIntersectingPairs tells of, or those of them with a face of `of`.
std::vector<FacePair> FindIntersecting(const std::vector<Eigen::Vector3d>& vertices_mm,
                                       const std::vector<Face>& faces, const std::vector<bool>* of) {
  double largest = 0;
  for (const Eigen::Vector3d& v : vertices_mm) largest = std::max(largest, v.cwiseAbs().maxCoeff());
  const double margin_mm = kCoordinateRounding * largest;
  const auto intersects = [&](int a, int b) {
    Face face_a = faces[a], face_b = faces[b];
    const int shared = SharedVertices(face_a, face_b);
    if (shared > 1) return false;
    if (shared == 1) StartAtSharedVertex(face_a, face_b);
    Triangle s, t;
    SetCorners(vertices_mm, face_a, s);
    SetCorners(vertices_mm, face_b, t);
    if (shared == 1 ? PointApart(s, t) || PointApart(t, s) : !ComeWithin(margin_mm, s, t)) return false;
    const auto meet = shared == 1 ? MeetBesidesFirstCorner : TrianglesIntersect;
    if (meet(s, t)) return true;
    RoundToFloat(s);
    RoundToFloat(t);
    return meet(s, t);
  };
  return FindPairs(FaceGrid(vertices_mm, faces, margin_mm), of, intersects);
}

IntersectingPairs Sorted(const std::vector<FacePair>& all, const std::vector<Face>& faces) {
  IntersectingPairs pairs;
  for (const FacePair& pair : all) {
    const bool shared = SharedVertices(faces[pair.a], faces[pair.b]) > 0;
    (shared ? pairs.at_vertex : pairs.apart).push_back(pair);
  }
  return pairs;
}

}  // namespace

bool TrianglesIntersect(const Triangle& s, const Triangle& t) { return ComeWithin(0, s, t); }

std::optional<double> SegmentThroughTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                                             const Triangle& t) {
  const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double from = normal.dot(p - t[0]), to = normal.dot(q - t[0]);
  if ((from > 0 && to > 0) || (from < 0 && to < 0)) return std::nullopt;
  const Eigen::Vector3d way = q - p;
  // In the triangle's plane, as far as rounding lets one tell.
  if (std::abs(from - to) <= kParallel * way.norm() * normal.norm()) return std::nullopt;
  const Eigen::Vector3d a = t[0] - p, b = t[1] - p, c = t[2] - p;
  const double ab = way.dot(a.cross(b)), bc = way.dot(b.cross(c)), ca = way.dot(c.cross(a));
  const bool inside = (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
  if (!inside) return std::nullopt;
  return from / (from - to);
}

std::vector<FacePair> FindSelfIntersections(const std::vector<Eigen::Vector3d>& vertices_mm,
                                            const std::vector<Face>& faces) {
  return FindPairs(FaceGrid(vertices_mm, faces, 0), nullptr, [&](int a, int b) {
    if (SharedVertices(faces[a], faces[b]) > 0) return false;
    Triangle s, t;
    SetCorners(vertices_mm, faces[a], s);
    SetCorners(vertices_mm, faces[b], t);
    return TrianglesIntersect(s, t);
  });
}

IntersectingPairs FindIntersectingPairs(const std::vector<Eigen::Vector3d>& vertices_mm,
                                        const std::vector<Face>& faces) {
  return Sorted(FindIntersecting(vertices_mm, faces, nullptr), faces);
}

IntersectingPairs FindIntersectingPairsAgain(const std::vector<Eigen::Vector3d>& vertices_mm,
                                             const std::vector<Face>& faces, const IntersectingPairs& before,
                                             const std::vector<bool>& moved) {
  std::vector<bool> of;
  for (const auto& [a, b, c] : faces) of.push_back(moved[a] || moved[b] || moved[c]);
  std::vector<FacePair> pairs = FindIntersecting(vertices_mm, faces, &of);
  for (const std::vector<FacePair>* some : {&before.apart, &before.at_vertex}) {
    std::copy_if(some->begin(), some->end(), std::back_inserter(pairs),
                 [&](const FacePair& pair) { return !of[pair.a] && !of[pair.b]; });
  }
  std::sort(pairs.begin(), pairs.end());
  return Sorted(pairs, faces);
}

}  // namespace weft
