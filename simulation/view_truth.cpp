#include "simulation/view_truth.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace weft {
namespace {

constexpr double kProbeOffset = 1.0 / 3;  // of the nine points, in cells from the node
constexpr float kClearance_mm = 0.05f;    // how near to itself a surface does not hide
constexpr double kAtVertex = 1e-6;        // a weight this near to 1 is the vertex itself
constexpr int kProbesNeeded = 5;

struct Probe {
  bool on_cloth = false;
  bool has_place = false;  // on the cloth, or where its print would go on
  int face = -1;
  int vertex = -1;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  bool in_sight = false;
  std::optional<Eigen::Vector2d> pixel_px;
};

BoardPoint OffsetOf(int probe) { return kProbeOffset * BoardPoint(probe % 3 - 1, probe / 3 - 1); }

class ViewProbe {
 public:
  ViewProbe(const TriangleMesh& mesh, const PrintLocator& print, const RayScene& rays,
            const CameraModel& camera, const ScoreableOptions& options)
      : mesh_(mesh),
        print_(print),
        rays_(rays),
        camera_(camera),
        options_(options),
        eye_mm_(camera.CenterWorld()) {}

  std::optional<NodeTruth> Observe(const BoardNode& node) const {
    const double half = node.kind == NodeKind::kCenter ? 0.5 : 0.0;
    const BoardPoint place(node.col + half, node.row + half);
    Probes probes;
    for (int k = 0; k < 9; ++k) probes[k] = ProbeAt(place + OffsetOf(k));
    Probe& middle = probes[4];
    if (!middle.on_cloth && !ContinuePrint(place, probes)) return std::nullopt;
    middle.pixel_px = camera_.Project(middle.position_mm);
    if (!middle.pixel_px || !camera_.Contains(*middle.pixel_px)) return std::nullopt;
    if (!SetInSight(probes)) return std::nullopt;

    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    bool complete = true;
    int seen = 0;
    for (Probe& p : probes) {
      if (p.has_place && &p != &middle) p.pixel_px = camera_.Project(p.position_mm);
      normal += p.normal;
      complete = complete && p.on_cloth && p.pixel_px;
      seen += p.in_sight && p.pixel_px ? 1 : 0;
    }
    if (seen == 0) return std::nullopt;
    const Eigen::Vector3d to_eye = (eye_mm_ - middle.position_mm).normalized();
    const double cosine = normal.normalized().dot(to_eye);

    NodeTruth out;
    out.node = node;
    if (node.kind == NodeKind::kCenter) out.vertex = middle.vertex;
    out.pixel_px = *middle.pixel_px;
    out.facing_deg = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
    out.pitch_px = Pitch(probes);
    out.visible = seen >= kProbesNeeded && middle.in_sight;
    out.scoreable = out.visible && complete && out.pitch_px >= options_.min_pitch_px &&
                    out.facing_deg < options_.max_facing_deg;
    return out;
  }

 private:
  using Probes = std::array<Probe, 9>;

  Probe ProbeAt(const BoardPoint& place) const {
    Probe out;
    const std::optional<SurfacePoint> point = print_.Find(place);
    if (!point) return out;
    const Face& face = mesh_.faces[point->face];
    const Eigen::Vector3d &a = mesh_.vertices_mm[face[0]], &b = mesh_.vertices_mm[face[1]],
                          &c = mesh_.vertices_mm[face[2]];
    out.on_cloth = out.has_place = true;
    out.face = point->face;
    int corner = 0;
    if (point->weights.maxCoeff(&corner) > 1 - kAtVertex) out.vertex = face[corner];
    out.position_mm = PositionOf(*point, mesh_.vertices_mm, mesh_.faces);
    out.normal = (b - a).cross(c - a).normalized();
    return out;
  }

  // A cell that is cut through has its middle where the print would go on along the nearest face.
  bool ContinuePrint(const BoardPoint& place, Probes& probes) const {
    int face = -1;
    for (const int k : {1, 3, 5, 7, 0, 2, 6, 8})
      if (face < 0 && probes[k].on_cloth) face = probes[k].face;
    if (face < 0) return false;
    for (int k = 0; k < 9; ++k) {
      if (probes[k].on_cloth) continue;
      const SurfacePoint point = print_.Beyond(face, place + OffsetOf(k));
      probes[k].position_mm = PositionOf(point, mesh_.vertices_mm, mesh_.faces);
      probes[k].has_place = true;
    }
    return true;
  }

  // False when none is in sight.
  bool SetInSight(Probes& probes) const {
    RayScene::Packet rays;
    std::array<Probe*, 9> of_ray;
    for (Probe& p : probes) {
      const Eigen::Vector3d way = eye_mm_ - p.position_mm;
      const double length = way.norm();
      if (!p.on_cloth || !(p.normal.dot(way) > 0) || length <= kClearance_mm) continue;
      of_ray[rays.count] = &p;
      // From the surface, where single precision is finest.
      rays.Add(p.position_mm.cast<float>(), (way / length).cast<float>(), kClearance_mm,
               static_cast<float>(length));
    }
    if (rays.count == 0) return false;
    const uint32_t hidden = rays_.Occluded(rays);
    for (int k = 0; k < rays.count; ++k) of_ray[k]->in_sight = (hidden >> k & 1) == 0;
    return std::any_of(probes.begin(), probes.end(), [](const Probe& p) { return p.in_sight; });
  }

  // From the largest of the parallelograms that the probes span, so that nodes at the cloth's edge have one.
  static double Pitch(const std::array<Probe, 9>& probes) {
    const auto seen = [&](int k) { return probes[k].pixel_px.has_value(); };
    const auto span = [&](int a, int b) {
      return Eigen::Vector2d((*probes[b].pixel_px - *probes[a].pixel_px) / kProbeOffset);
    };
    if (seen(0) && seen(2) && seen(6) && seen(8)) {
      const Eigen::Vector2d d1 = span(0, 8) / 2, d2 = span(2, 6) / 2;  // diagonals of the cell
      return std::sqrt(std::abs(d1.x() * d2.y() - d1.y() * d2.x()) / 2);
    }
    double largest = 0;
    for (const int across : {3, 5})
      for (const int down : {1, 7}) {
        if (!seen(across) || !seen(down)) continue;
        const Eigen::Vector2d u = span(4, across), v = span(4, down);
        largest = std::max(largest, std::abs(u.x() * v.y() - u.y() * v.x()));
      }
    return std::sqrt(largest);
  }

  const TriangleMesh& mesh_;
  const PrintLocator& print_;
  const RayScene& rays_;
  const CameraModel& camera_;
  const ScoreableOptions& options_;
  const Eigen::Vector3d eye_mm_;
};

}  // namespace

ViewTruth FindViewTruth(const TriangleMesh& mesh, const PrintLocator& print, const RayScene& rays,
                        const CameraModel& camera, const ScoreableOptions& options) {
  const ViewProbe view(mesh, print, rays, camera, options);
  const int rows = print.row_end() - print.row_begin();
  ViewTruth out;
  out.camera_id = camera.id;
  for (const NodeKind kind : {NodeKind::kCenter, NodeKind::kCorner}) {
    const int extra = kind == NodeKind::kCorner ? 1 : 0;
    std::vector<std::vector<NodeTruth>> by_row(std::max(0, rows) + extra);
    tbb::parallel_for(tbb::blocked_range<int>(0, static_cast<int>(by_row.size())), [&](const auto& range) {
      for (int r = range.begin(); r < range.end(); ++r)
        for (int c = print.col_begin(); c < print.col_end() + extra; ++c)
          if (std::optional<NodeTruth> node = view.Observe({print.row_begin() + r, c, kind}))
            by_row[r].push_back(*node);
    });
    for (const auto& row : by_row) out.nodes.insert(out.nodes.end(), row.begin(), row.end());
  }
  return out;
}

}  // namespace weft
