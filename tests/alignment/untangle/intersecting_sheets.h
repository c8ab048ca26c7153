// Sheets that pass through themselves or each other.
#pragma once

#include <numbers>
#include <numeric>

#include "alignment/untangle/untangle_patch.h"
#include "tests/alignment/cloth_sheets.h"

namespace weft::testing {

inline TriangleMesh Joined(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh mesh = a;
  const int base = static_cast<int>(a.vertices_mm.size());
  mesh.vertices_mm.insert(mesh.vertices_mm.end(), b.vertices_mm.begin(), b.vertices_mm.end());
  for (const Face& f : b.faces) mesh.faces.push_back({f[0] + base, f[1] + base, f[2] + base});
  return mesh;
}

inline TriangleMesh Shaped(TriangleMesh mesh,
                           const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& shape) {
  mesh.vertices_mm = Mapped(mesh.vertices_mm, shape);
  return mesh;
}

// A sheet of n x n vertices and another one above it, dented through the first in the middle: by depth_mm
// below it, over radius_mm.
inline TriangleMesh DentedLayers(int n, double depth_mm, double radius_mm) {
  const double middle = (n - 1) * kCellMm / 2 + 0.3;
  return Joined(FlatSheet(n, n), Shaped(FlatSheet(n, n), [&](const Eigen::Vector3d& p) {
                  const double r = std::hypot(p.x() - middle, p.y() - middle) / radius_mm;
                  return Eigen::Vector3d(p.x() + 0.7, p.y() + 0.4, 1.5 - (depth_mm + 1.5) * std::exp(-r * r));
                }));
}

// A fold across the sheet whose sides have passed through each other half-way along it: seen from the side
// the sheet is an open arch at both ends and a loop in between. The loop is there for pinch > 0.4.
inline TriangleMesh PinchedFold(int n, double pinch) {
  const double middle = (n - 1) * kCellMm / 2;
  return Shaped(FlatSheet(n, n), [&](const Eigen::Vector3d& p) {
    const double t = p.x() - middle + 0.3, along = (p.y() - middle) / 20;
    const double arch = std::exp(-t * t / 200);
    const double narrow = 0.6 + pinch * std::exp(-along * along);
    return Eigen::Vector3d(middle + t * (1 - narrow * arch), p.y() + 0.01 * t, 14 * arch);
  });
}

// A tube of radius_mm around the x axis, its ends open.
inline TriangleMesh Tube(int around, int along, double radius_mm) {
  TriangleMesh mesh;
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < around; ++j) {
      const double angle = 2 * std::numbers::pi * j / around;
      mesh.vertices_mm.emplace_back(i * kCellMm, radius_mm * std::cos(angle), radius_mm * std::sin(angle));
    }
  }
  for (int i = 0; i + 1 < along; ++i) {
    for (int j = 0; j < around; ++j) {
      const int a = i * around + j, b = i * around + (j + 1) % around;
      mesh.faces.push_back({a, b, b + around});
      mesh.faces.push_back({a, b + around, a + around});
    }
  }
  return mesh;
}

// A sleeve that lies along a wider torso and dips depth_mm into it.
inline TriangleMesh SleeveInTorso(double depth_mm) {
  const TriangleMesh torso = Tube(140, 60, 60);
  return Joined(torso, Shaped(Tube(48, 50, 20), [&](const Eigen::Vector3d& p) {
                  const double bend = std::cos((p.x() - 66) / 40);
                  return Eigen::Vector3d(p.x() + 13.2, p.y() + 0.2, p.z() + 80 - depth_mm * bend);
                }));
}

// Two sheets side by side, tilted against each other so that the edge of each cuts into the other.
inline TriangleMesh CrossedHems(int n) {
  const auto tilted = [](double angle, double dx) {
    return [=](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(p.x() + dx, p.y() * std::cos(angle) + 0.13,
                             p.y() * std::sin(angle) - 9 * std::sin(angle));
    };
  };
  return Joined(Shaped(FlatSheet(n, n), tilted(0.12, 0)),
                Shaped(FlatSheet(n, n), tilted(-0.12, (n - 3) * kCellMm + 0.7)));
}

// Two rough sheets at almost the same place.
inline TriangleMesh RoughLayers(int n, double roughness_mm, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto rough = [&](double height_mm) {
    double phase[6][3];
    for (auto& wave : phase) {
      for (double& value : wave) value = 2 * std::numbers::pi * unit(random);
    }
    return Shaped(FlatSheet(n, n), [&](const Eigen::Vector3d& p) {
      double z = height_mm;
      for (int i = 0; i < 6; ++i) {
        const double length = 12 + 8 * i;
        z += roughness_mm / 3 *
             std::sin(2 * std::numbers::pi * (p.x() * std::cos(phase[i][0]) + p.y() * std::sin(phase[i][0])) /
                          length +
                      phase[i][1]);
      }
      return Eigen::Vector3d(p.x(), p.y(), z);
    });
  };
  const TriangleMesh below = rough(0);
  TriangleMesh above = rough(1);
  for (Eigen::Vector3d& v : above.vertices_mm) v += Eigen::Vector3d(0.83, 0.41, 0);
  return Joined(below, above);
}

// Two faces with one vertex in common; the side of one opposite to it passes through the other.
inline TriangleMesh FacesThroughEachOtherAtAVertex() {
  return {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, 1}, {1.2, 1, -1}}, {{0, 1, 2}, {0, 3, 4}}};
}

// All of its vertices may move.
inline UntanglePatch WholeMesh(const TriangleMesh& mesh) {
  std::vector<int> all(mesh.vertices_mm.size());
  std::iota(all.begin(), all.end(), 0);
  return CutPatch(mesh.vertices_mm, mesh.vertices_mm, mesh.faces, {}, {}, all, 8);
}

}  // namespace weft::testing
