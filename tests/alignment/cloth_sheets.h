// Sheets of cloth whose shape at rest and bent is known in closed form.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "alignment/align.h"

namespace weft::testing {

inline constexpr double kCellMm = 2.7;

// rows x cols vertices in the plane z = 0, vertex row * cols + col at (col, row) * 2.7 mm; diagonals
// alternate.
inline TriangleMesh FlatSheet(int rows, int cols) {
  TriangleMesh mesh;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) mesh.vertices_mm.emplace_back(c * kCellMm, r * kCellMm, 0);
  }
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < cols; ++c) {
      const int v00 = r * cols + c, v01 = v00 + 1, v10 = v00 + cols, v11 = v10 + 1;
      if ((r + c) % 2 == 0) {
        mesh.faces.push_back({v00, v01, v11});
        mesh.faces.push_back({v00, v11, v10});
      } else {
        mesh.faces.push_back({v00, v01, v10});
        mesh.faces.push_back({v01, v11, v10});
      }
    }
  }
  return mesh;
}

inline Template SheetTemplate(TriangleMesh mesh) {
  Template garment;
  garment.id = "sheet";
  garment.board_hash = "0123456789abcdef";
  garment.node_of_vertex.resize(mesh.vertices_mm.size());
  garment.rest = std::move(mesh);
  return garment;
}

// The plane z = 0 rolled onto a cylinder, which keeps all lengths along the surface.
inline Eigen::Vector3d Rolled(const Eigen::Vector3d& p, double radius_mm) {
  const double angle = p.x() / radius_mm;
  return {radius_mm * std::sin(angle), p.y(), radius_mm * (1 - std::cos(angle))};
}

inline std::vector<Eigen::Vector3d> Mapped(
    const std::vector<Eigen::Vector3d>& points,
    const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& map) {
  std::vector<Eigen::Vector3d> out;
  for (const Eigen::Vector3d& p : points) out.push_back(map(p));
  return out;
}

inline Eigen::Isometry3d SomeMotion() {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.translate(Eigen::Vector3d(812, -455, 2310));
  motion.rotate(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()));
  return motion;
}

// A target for every vertex that `is_seen`, with Gaussian noise of noise_mm per axis.
inline std::vector<VertexTarget> Measure(
    const std::vector<Eigen::Vector3d>& truth, double noise_mm, uint32_t seed,
    const std::function<bool(int)>& is_seen = [](int) { return true; }) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  std::vector<VertexTarget> targets;
  for (int v = 0; v < static_cast<int>(truth.size()); ++v) {
    if (!is_seen(v)) continue;
    const Eigen::Vector3d error(noise(random), noise(random), noise(random));
    targets.push_back({v, truth[v] + noise_mm * error, 0, 4});
  }
  return targets;
}

inline double MaxDistance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

// Mean distance of the vertices that `counts` picks.
inline double MeanError(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& truth,
                        const std::function<bool(int)>& counts) {
  double sum = 0;
  int count = 0;
  for (size_t v = 0; v < a.size(); ++v) {
    if (!counts(static_cast<int>(v))) continue;
    sum += (a[v] - truth[v]).norm();
    ++count;
  }
  return sum / count;
}

}  // namespace weft::testing
