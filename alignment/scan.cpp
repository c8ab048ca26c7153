#include "alignment/scan.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"

namespace weft {
namespace {

// Vertices in cubes of one size, for the nearest within that size.
class VertexGrid {
 public:
  VertexGrid(const std::vector<Eigen::Vector3d>& vertices_mm, double cube_mm)
      : vertices_mm_(vertices_mm), cube_mm_(cube_mm) {
    for (size_t v = 0; v < vertices_mm.size(); ++v) {
      entries_.emplace_back(Key(CubeOf(vertices_mm[v])), static_cast<int>(v));
    }
    std::sort(entries_.begin(), entries_.end());
  }

  // -1 where none is within the size of a cube.
  int Nearest(const Eigen::Vector3d& p) const {
    const Cube center = CubeOf(p);
    double best = cube_mm_ * cube_mm_;
    int nearest = -1;
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        // Cubes that follow each other along z have keys that do so, too.
        const uint64_t low = Key({center[0] + dx, center[1] + dy, center[2] - 1});
        auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair<uint64_t, int>(low, -1));
        for (; at != entries_.end() && at->first <= low + 2; ++at) {
          const double d2 = (vertices_mm_[at->second] - p).squaredNorm();
          if (d2 > best || (d2 == best && nearest >= 0 && nearest < at->second)) continue;
          best = d2;
          nearest = at->second;
        }
      }
    }
    return nearest;
  }

 private:
  using Cube = std::array<int64_t, 3>;

  Cube CubeOf(const Eigen::Vector3d& p) const {
    const auto index = [this](double x) {
      return static_cast<int64_t>(std::floor(std::clamp(x / cube_mm_, -1e6, 1e6)));
    };
    return {index(p.x()), index(p.y()), index(p.z())};
  }
  static uint64_t Key(const Cube& c) {
    const auto part = [](int64_t i) { return static_cast<uint64_t>(i + (1 << 20)) & ((1ULL << 21) - 1); };
    return part(c[0]) << 42 | part(c[1]) << 21 | part(c[2]);
  }

  const std::vector<Eigen::Vector3d>& vertices_mm_;
  double cube_mm_;
  std::vector<std::pair<uint64_t, int>> entries_;  // ordered by cube, then vertex
};

}  // namespace

absl::Status AssociationOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("recon.association.", what));
  };
  if (!(max_distance_mm > 0) || !std::isfinite(max_distance_mm))
    return bad("max_distance_mm must be positive");
  if (!(max_normal_angle_deg > 0 && max_normal_angle_deg <= 180)) {
    return bad("max_normal_angle_deg must lie in 0 to 180");
  }
  return absl::OkStatus();
}

std::vector<ScanPull> AssociateScan(const Scan& scan, const std::vector<Eigen::Vector3d>& vertices_mm,
                                    const std::vector<Face>& faces, const std::vector<bool>& wanted,
                                    const AssociationOptions& options) {
  const VertexGrid grid(vertices_mm, options.max_distance_mm);
  const std::vector<Eigen::Vector3d> normals = VertexNormals(vertices_mm, faces);
  const double min_cosine = std::cos(options.max_normal_angle_deg * std::numbers::pi / 180);
  std::vector<int> nearest(scan.points_mm.size(), -1);
  tbb::parallel_for(size_t{0}, scan.points_mm.size(), [&](size_t i) {
    const int v = grid.Nearest(scan.points_mm[i]);
    if (v < 0 || !wanted[v]) return;
    if (!scan.normals.empty() && scan.normals[i].dot(normals[v]) < min_cosine) return;
    nearest[i] = v;
  });
  std::vector<ScanPull> by_vertex(vertices_mm.size());
  for (size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i] < 0) continue;
    ScanPull& pull = by_vertex[nearest[i]];
    pull.position_mm += scan.points_mm[i];
    ++pull.points;
  }
  std::vector<ScanPull> pulls;
  for (size_t v = 0; v < by_vertex.size(); ++v) {
    if (by_vertex[v].points == 0) continue;
    pulls.push_back({static_cast<int>(v), by_vertex[v].position_mm / by_vertex[v].points, normals[v],
                     by_vertex[v].points});
  }
  return pulls;
}

}  // namespace weft
