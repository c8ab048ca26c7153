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
#include "absl/strings/str_format.h"
#include "alignment/vertex_normals.h"
#include "base/median.h"

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

struct Unit {
  const char* name;
  double mm;
};
constexpr std::array<Unit, 4> kUnits = {
    {{"metres", 1000}, {"centimetres", 10}, {"inches", 25.4}, {"feet", 304.8}}};

// A scan that finds this share of the vertices lies on the cloth as it is.
constexpr double kPlainShare = 0.25;
// In its own unit a scan finds many times as many vertices: that in centimetres, the unit next to mm, is as
// large as a hundredth of the cloth. Below the share it lies on the cloth by chance.
constexpr int kManyTimes = 4;
constexpr double kLeastFoundShare = 0.02;

// A scan in metres is a thousandth as large as the cloth, also where it lies in another place.
constexpr double kLeastExtent = 0.01;

double ExtentMm(const std::vector<Eigen::Vector3d>& points_mm) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points_mm) box.extend(p);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

// Normals that are wrong on average: of a scan of both sides of the cloth half are inward.
// Fewer points than the share say nothing.
constexpr int kMostlyInward = 3;
constexpr double kTellingShare = 0.01;

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

ScanFit FitOfScan(const Scan& scan, const std::vector<Eigen::Vector3d>& vertices_mm,
                  const std::vector<Face>& faces, const AssociationOptions& options) {
  const VertexGrid grid(vertices_mm, options.max_distance_mm);
  const std::vector<Eigen::Vector3d> normals = VertexNormals(vertices_mm, faces);
  const double min_cosine = std::cos(options.max_normal_angle_deg * std::numbers::pi / 180);
  std::vector<int> nearest(scan.points_mm.size(), -1);
  tbb::parallel_for(size_t{0}, scan.points_mm.size(),
                    [&](size_t i) { nearest[i] = grid.Nearest(scan.points_mm[i]); });
  ScanFit fit;
  std::vector<bool> found(vertices_mm.size(), false);
  int64_t close_outward = 0, close_inward = 0;
  std::vector<double> outward_mm, inward_mm;
  for (size_t i = 0; i < nearest.size(); ++i) {
    const int v = nearest[i];
    if (v < 0) continue;
    ++fit.near;
    found[v] = true;
    const double cosine = scan.normals.empty() ? 1 : scan.normals[i].dot(normals[v]);
    const Eigen::Vector3d offset_mm = scan.points_mm[i] - vertices_mm[v];
    const bool is_close = offset_mm.norm() < options.max_distance_mm / 2;
    if (cosine >= min_cosine) outward_mm.push_back(std::abs(offset_mm.dot(normals[v])));
    if (cosine <= -min_cosine) inward_mm.push_back(std::abs(offset_mm.dot(normals[v])));
    close_outward += is_close && cosine >= min_cosine;
    close_inward += is_close && cosine <= -min_cosine;
  }
  fit.vertices = static_cast<int>(std::count(found.begin(), found.end(), true));
  fit.outward = static_cast<int>(outward_mm.size());
  fit.inward = static_cast<int>(inward_mm.size());
  const double telling = kTellingShare * static_cast<double>(scan.points_mm.size());
  fit.is_turned = close_inward > kMostlyInward * close_outward && static_cast<double>(close_inward) > telling;
  fit.median_distance_mm = Median(fit.is_turned ? std::move(inward_mm) : std::move(outward_mm));
  return fit;
}

absl::Status CheckScanUnit(const Scan& scan, const ScanFit& fit,
                           const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces,
                           const AssociationOptions& options) {
  const auto vertices = static_cast<double>(vertices_mm.size());
  if (fit.vertices >= kPlainShare * vertices) return absl::OkStatus();
  const Unit* best = nullptr;
  ScanFit best_fit;
  for (const Unit& unit : kUnits) {
    Scan scaled;
    for (const Eigen::Vector3d& p : scan.points_mm) scaled.points_mm.push_back(unit.mm * p);
    const ScanFit in_unit = FitOfScan(scaled, vertices_mm, faces, options);
    if (in_unit.vertices <= best_fit.vertices) continue;
    best = &unit, best_fit = in_unit;
  }
  if (best == nullptr || best_fit.vertices < kLeastFoundShare * vertices ||
      best_fit.vertices < kManyTimes * fit.vertices) {
    const double scan_mm = ExtentMm(scan.points_mm), cloth_mm = ExtentMm(vertices_mm);
    if (scan_mm > kLeastExtent * cloth_mm) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: is %.3g mm large, and the cloth %.0f mm; is it in metres? Give it in mm",
                        scan.name, scan_mm, cloth_mm));
  }
  return absl::InvalidArgumentError(absl::StrCat(
      scan.name, ": is in ", best->name, ": as mm its points find ", fit.vertices,
      " vertices of the cloth, as ", best->name, " ", best_fit.vertices, "; multiply it by ", best->mm));
}

}  // namespace weft
