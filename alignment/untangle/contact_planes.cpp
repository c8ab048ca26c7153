#include "alignment/untangle/contact_planes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "alignment/untangle/closest_points.h"
#include "alignment/untangle/face_grid.h"

namespace weft {
namespace {

constexpr double kUsedShare = 0.9;    // of the room between two, so that rounding does not close it
constexpr double kTouchingMm = 1e-9;  // no normal can be told

// Those whose boxes come within reach of the box of all that moves.
std::vector<int> FacesWithinReach(const UntanglePatch& patch, const std::vector<bool>& moves,
                                  double reach_mm) {
  Eigen::AlignedBox3d moving;
  for (const Face& f : patch.faces) {
    if (!moves[f[0]] && !moves[f[1]] && !moves[f[2]]) continue;
    for (const int v : f) moving.extend(patch.position_mm[v]);
  }
  std::vector<int> some;
  if (moving.isEmpty()) return some;
  moving.min().array() -= reach_mm;
  moving.max().array() += reach_mm;
  for (int f = 0; f < static_cast<int>(patch.faces.size()); ++f) {
    Eigen::AlignedBox3d box;
    for (const int v : patch.faces[f]) box.extend(patch.position_mm[v]);
    if (moving.intersects(box)) some.push_back(f);
  }
  return some;
}

class Collector {
 public:
  Collector(const UntanglePatch& patch, const std::vector<bool>& moves, double reach_mm, double gap_mm)
      : patch_(patch), moves_(moves), reach_mm_(reach_mm), gap_mm_(gap_mm) {
    for (const Face& f : patch.faces) face_moves_.push_back(moves[f[0]] || moves[f[1]] || moves[f[2]]);
  }

  void AddPair(int a, int b) {
    AddCorners(a, b);
    AddCorners(b, a);
    for (const int e : patch_.edges_of_face[a]) {
      for (const int f : patch_.edges_of_face[b]) {
        // Each edge is met as that of the first of its faces.
        if (patch_.edges[e].face[0] == a && patch_.edges[f].face[0] == b)
          AddEdges(patch_.edges[e], patch_.edges[f]);
      }
    }
  }

  ContactPlanes Take() {
    ContactPlanes result;
    result.first.assign(patch_.free + 1, 0);
    for (const ContactPlane& plane : planes_) ++result.first[plane.vertex + 1];
    std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
    std::vector<int> next(result.first.begin(), result.first.end() - 1);
    result.planes.resize(planes_.size());
    for (const ContactPlane& plane : planes_) result.planes[next[plane.vertex]++] = plane;
    result.contacts = std::move(contacts_);
    return result;
  }

 private:
  const Eigen::Vector3d& At(int v) const { return patch_.position_mm[v]; }

  // The corners that belong to this face first of all, against the other face.
  void AddCorners(int corners_of, int f) {
    const Face& face = patch_.faces[f];
    for (const int v : patch_.faces[corners_of]) {
      if (patch_.FacesOf(v)[0] != corners_of) continue;
      if (v == face[0] || v == face[1] || v == face[2]) continue;
      if (!moves_[v] && !face_moves_[f]) continue;
      const Eigen::Vector3d &a = At(face[0]), &b = At(face[1]), &c = At(face[2]);
      const Eigen::Vector3d across = (b - a).cross(c - a);
      const double height = across.dot(At(v) - a);
      if (height * height > reach_mm_ * reach_mm_ * across.squaredNorm()) continue;
      const Eigen::Vector3d shares = ClosestOnTriangle(At(v), a, b, c);
      const Eigen::Vector3d point = shares[0] * a + shares[1] * b + shares[2] * c;
      Add({v}, At(v), {face[0], face[1], face[2]}, point);
    }
  }

  void AddEdges(const PatchEdge& e, const PatchEdge& f) {
    if (e.a == f.a || e.a == f.b || e.b == f.a || e.b == f.b) return;
    if (!moves_[e.a] && !moves_[e.b] && !moves_[f.a] && !moves_[f.b]) return;
    const Eigen::Vector3d across = (At(e.b) - At(e.a)).cross(At(f.b) - At(f.a));
    const double height = across.dot(At(f.a) - At(e.a));
    if (height * height > reach_mm_ * reach_mm_ * across.squaredNorm()) return;
    const Eigen::Vector2d at = ClosestOnSegments(At(e.a), At(e.b), At(f.a), At(f.b));
    Add({e.a, e.b}, At(e.a) + at[0] * (At(e.b) - At(e.a)), {f.a, f.b}, At(f.a) + at[1] * (At(f.b) - At(f.a)));
  }

  void Add(std::initializer_list<int> ones, const Eigen::Vector3d& p, std::initializer_list<int> others,
           const Eigen::Vector3d& q) {
    const double distance = (p - q).norm();
    if (distance > reach_mm_) return;
    const Eigen::Vector3d normal =
        distance > kTouchingMm ? Eigen::Vector3d((p - q) / distance) : Eigen::Vector3d::Zero();
    const double room = (distance - gap_mm_) / 2;
    const auto add = [&](int v, const Eigen::Vector3d& own_side, double beyond) {
      if (!moves_[v]) return;
      const double all = room + std::max(beyond, 0.0);
      planes_.push_back({v, static_cast<int>(contacts_.size()), own_side, all > 0 ? kUsedShare * all : all});
    };
    for (const int v : ones) add(v, normal, normal.dot(At(v) - p));
    for (const int v : others) add(v, -normal, normal.dot(q - At(v)));
    Contact& contact = contacts_.emplace_back();
    contact.ones = static_cast<int>(ones.size());
    std::copy(others.begin(), others.end(), std::copy(ones.begin(), ones.end(), contact.vertices.begin()));
  }

  const UntanglePatch& patch_;
  const std::vector<bool>& moves_;
  std::vector<bool> face_moves_;  // [faces]
  const double reach_mm_, gap_mm_;
  std::vector<ContactPlane> planes_;
  std::vector<Contact> contacts_;
};

}  // namespace

ContactPlanes FindContactPlanes(const UntanglePatch& patch, const std::vector<bool>& moves, double reach_mm,
                                double gap_mm) {
  const std::vector<int> some = FacesWithinReach(patch, moves, reach_mm);
  std::vector<Face> faces;
  for (const int f : some) faces.push_back(patch.faces[f]);
  const FaceGrid grid(patch.position_mm, faces, reach_mm / 2);
  std::vector<bool> moving;
  for (const Face& f : faces) moving.push_back(moves[f[0]] || moves[f[1]] || moves[f[2]]);
  Collector collector(patch, moves, reach_mm, gap_mm);
  grid.VisitPairsOf(moving, 0, grid.cells(), [&](int a, int b) { collector.AddPair(some[a], some[b]); });
  return collector.Take();
}

}  // namespace weft
