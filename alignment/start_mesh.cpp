#include "alignment/start_mesh.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/placement.h"
#include "alignment/print_scale.h"
#include "base/median.h"

namespace weft {
namespace {

// Results of `weft register` (a scanned shirt, presets of `weft simulate`): edges are 0.989 to 1.001 times as
// long as at rest in the median, single ones up to 2.2 times.
constexpr double kMostScale = 1.2;   // cloth stretches less as a whole
constexpr double kFarFromAll = 5;    // times the length of an edge at rest: no cloth does that
constexpr double kFarShare = 0.001;  // of the edges; single ones may be mistakes of a registration
constexpr double kTurnedDeg = 30;    // of a body between two moments; the fill follows that
constexpr double kMirroredShare =
    0.5;  // of the distance that is left, when a mirror image lies so much nearer

Face SortedCorners(Face face) {
  std::sort(face.begin(), face.end());
  return face;
}

absl::Status CheckFaces(const std::vector<Face>& start, const std::vector<Face>& rest) {
  if (start == rest) return absl::OkStatus();
  std::vector<Face> known;
  known.reserve(rest.size());
  for (const Face& face : rest) known.push_back(SortedCorners(face));
  std::sort(known.begin(), known.end());
  for (size_t f = 0; f < start.size(); ++f) {
    const Face& face = start[f];
    if (std::binary_search(known.begin(), known.end(), SortedCorners(face))) continue;
    return absl::InvalidArgumentError(absl::StrCat("face ", f, " joins vertices ", face[0], ", ", face[1],
                                                   " and ", face[2],
                                                   ", which no face of the template does: its vertices are "
                                                   "in another order, or it is the mesh of another "
                                                   "template. Programs that read and write meshes often "
                                                   "renumber vertices; give a mesh as Weft wrote it"));
  }
  return absl::OkStatus();
}

absl::Status CheckEdgeLengths(const std::vector<Eigen::Vector3d>& start_mm, const TriangleMesh& rest) {
  std::vector<double> ratios;
  int64_t far = 0;
  size_t of_far = 0;                                 // a vertex of the first such edge
  std::vector<double> nearest(start_mm.size(), -1);  // of each vertex: its edge that is stretched least
  for (const Face& face : rest.faces) {
    for (size_t i = 0; i < 3; ++i) {
      const auto a = static_cast<size_t>(face[i]), b = static_cast<size_t>(face[(i + 1) % 3]);
      const double at_rest = (rest.vertices_mm[b] - rest.vertices_mm[a]).norm();
      if (!(at_rest > 0)) continue;
      const double ratio = (start_mm[b] - start_mm[a]).norm() / at_rest;
      ratios.push_back(ratio);
      if (ratio > kFarFromAll && far++ == 0) of_far = a;
      for (const size_t v : {a, b})
        if (nearest[v] < 0 || ratio < nearest[v]) nearest[v] = ratio;
    }
  }
  const auto edges = static_cast<double>(ratios.size());
  const double scale = Median(std::move(ratios));
  if (scale > kMostScale || scale < 1 / kMostScale) {
    const auto unit = UnitOfScale(scale);
    return absl::InvalidArgumentError(
        absl::StrCat("its edges are ", scale, " times as long as the template's; ",
                     unit ? absl::StrCat("it is in ", unit->plural, ", give it in mm")
                          : "it is in another unit than mm, or its vertices are in another order"));
  }
  for (size_t v = 0; v < nearest.size(); ++v) {
    if (nearest[v] <= kFarFromAll) continue;
    return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " is far from all its neighbours, ",
                                                   nearest[v],
                                                   " times as far as at rest or more; are its vertices in "
                                                   "another order?"));
  }
  if (static_cast<double>(far) > kFarShare * edges)
    return absl::InvalidArgumentError(absl::StrCat(far, " edges are over ", kFarFromAll,
                                                   " times as long as the template's, the first at vertex ",
                                                   of_far, "; are some of its vertices in another order?"));
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckStartMesh(const TriangleMesh& start, const TriangleMesh& rest) {
  absl::Status status = CheckStart(start.vertices_mm, static_cast<int>(rest.vertices_mm.size()));
  status.Update(CheckFaces(start.faces, rest.faces));
  if (!status.ok()) return status;
  return CheckEdgeLengths(start.vertices_mm, rest);
}

absl::StatusOr<PlacedStart> PlaceStart(std::vector<Eigen::Vector3d> start_mm,
                                       const std::vector<VertexTarget>& targets) {
  PlacedStart placed{std::move(start_mm), 0};
  if (targets.size() < 3) return placed;
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
  for (const VertexTarget& t : targets) {
    from += placed.vertices_mm[static_cast<size_t>(t.vertex)] / static_cast<double>(targets.size());
    to += t.position_mm / static_cast<double>(targets.size());
  }
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  double squares = 0;
  for (const VertexTarget& t : targets) {
    const Eigen::Vector3d a = placed.vertices_mm[static_cast<size_t>(t.vertex)] - from,
                          b = t.position_mm - to;
    moment += b * a.transpose();
    squares += a.squaredNorm() + b.squaredNorm();
  }
  // The best rotation or reflection leaves squares - 2 (s0 + s1 + s2), the best one of the other kind
  // squares - 2 (s0 + s1 - s2) (Umeyama 1991).
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moment, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d s = svd.singularValues();
  const bool reflection = svd.matrixU().determinant() * svd.matrixV().determinant() < 0;
  const double best = std::max(0.0, squares - 2 * s.sum()), other = squares - 2 * (s[0] + s[1] - s[2]);
  if (reflection && best < kMirroredShare * kMirroredShare * other) {
    return absl::InvalidArgumentError(
        "start: it is the mirror image of what the cloud shows: an axis has changed its sign, or two are "
        "exchanged");
  }
  Eigen::Vector3d signs(1, 1, reflection ? -1 : 1);
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  const double turned_deg = Eigen::AngleAxisd(rotation).angle() * 180 / std::numbers::pi;
  if (turned_deg <= kTurnedDeg) return placed;
  placed.turned_deg = turned_deg;
  for (Eigen::Vector3d& v : placed.vertices_mm) v = rotation * (v - from) + to;
  return placed;
}

}  // namespace weft
