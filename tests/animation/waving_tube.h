// A tube of cloth that bends, twists and breathes by three numbers, and what cameras see of it.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "alignment/template.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "tests/animation/drive_room.h"

namespace weft {

class WavingTube {
 public:
  static constexpr int kRows = 16, kColumns = 24;
  static constexpr double kHeightMm = 640, kRadiusMm = 150;

  static std::vector<Eigen::Vector3d> Shape(double bend, double twist, double swell) {
    std::vector<Eigen::Vector3d> out;
    for (int row = 0; row < kRows; ++row) {
      const double y = kHeightMm * (row / (kRows - 1.0) - 0.5), turn = bend * y / kHeightMm;
      for (int column = 0; column < kColumns; ++column) {
        const double around = 2 * std::numbers::pi * column / kColumns, at = around + twist * y / kHeightMm;
        const double radius = kRadiusMm * (1 + 0.15 * std::cos(2 * around) +
                                           swell * std::cos(around) * std::exp(-std::pow(y / 150, 2)));
        const Eigen::Vector3d on_ring(radius * std::sin(at), 0, -radius * std::cos(at));
        // The ring's middle on an arc, the ring across it.
        const double arc = std::abs(bend) < 1e-6 ? 0 : kHeightMm / bend;
        const Eigen::Vector3d middle =
            std::abs(bend) < 1e-6 ? Eigen::Vector3d(0, y, 0)
                                  : Eigen::Vector3d(0, arc * std::sin(turn), arc * (1 - std::cos(turn)));
        out.push_back(middle + Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitX()) * on_ring);
      }
    }
    return out;
  }

  // Where it is at a moment of a motion; the seed chooses the phases.
  static std::vector<Eigen::Vector3d> At(int frame, int seed) {
    const double t = frame, a = 1.7 * seed, b = 2.9 * seed, c = 0.6 * seed;
    std::vector<Eigen::Vector3d> out =
        Shape(0.12 * std::sin(0.11 * t + a), 0.4 * std::sin(0.07 * t + b), 0.01 * std::sin(0.13 * t + c));
    const Eigen::Isometry3d motion =
        Eigen::Translation3d(30 * std::sin(0.05 * t + c), 0, 20 * std::cos(0.04 * t)) *
        Eigen::AngleAxisd(0.3 * std::sin(0.06 * t + b), Eigen::Vector3d::UnitY());
    for (Eigen::Vector3d& p : out) p = motion * p;
    return out;
  }

  static Template Garment() {
    Template out;
    out.id = "tube";
    out.board_hash = "0123456789abcdef";
    out.rest.vertices_mm = Shape(0, 0, 0);
    for (int row = 0; row < kRows; ++row)
      for (int column = 0; column < kColumns; ++column) {
        out.node_of_vertex.push_back({row, column, NodeKind::kCenter});
        if (row + 1 == kRows) continue;
        const int next = (column + 1) % kColumns, a = row * kColumns + column, b = row * kColumns + next,
                  c = a + kColumns, d = b + kColumns;
        out.rest.faces.push_back({a, d, b});
        out.rest.faces.push_back({a, c, d});
      }
    return out;
  }

  static TrainingFrames Frames(int takes = 4, int frames = 50) {
    TrainingFrames out;
    for (int take = 0; take < takes; ++take)
      out.takes.push_back({"take " + std::to_string(take), frames, 30, take + 1 == takes});
    out.read = [](int take, int frame) { return At(frame, take); };
    return out;
  }

  // Vertices that face the camera, with noise; a share of them lies about where it is.
  static std::vector<Observation> Seen(const CameraModel& camera, const std::vector<Eigen::Vector3d>& mesh,
                                       uint64_t seed, double wrong_share = 0, double noise_px = 0.1) {
    const std::vector<Face> faces = Garment().rest.faces;
    std::vector<Eigen::Vector3d> normals(mesh.size(), Eigen::Vector3d::Zero());
    for (const Face& face : faces) {
      const Eigen::Vector3d n = (mesh[face[1]] - mesh[face[0]]).cross(mesh[face[2]] - mesh[face[0]]);
      for (const int v : face) normals[v] += n;
    }
    const uint64_t key = KeyOf(seed, camera.id);
    std::vector<Observation> out;
    for (size_t v = 0; v < mesh.size(); ++v) {
      const Eigen::Vector3d to = (mesh[v] - camera.CenterWorld()).normalized();
      if (-normals[v].normalized().dot(to) < 0.35) continue;
      Eigen::Vector2d pixel = *camera.Project(mesh[v]);
      pixel += noise_px * Eigen::Vector2d(NormalOf(key, 4 * v), NormalOf(key, 4 * v + 1));
      if (UniformOf(key, 4 * v + 2) < wrong_share) pixel += Eigen::Vector2d(180, -90);
      out.push_back({pixel.x(),
                     pixel.y(),
                     {static_cast<int>(v) / kColumns, static_cast<int>(v) % kColumns, NodeKind::kCenter},
                     static_cast<float>(noise_px),
                     1});
    }
    return out;
  }
};

inline std::vector<CameraModel> CamerasAround(int count) {
  std::vector<CameraModel> out;
  for (int k = 0; k < count; ++k)
    out.push_back(CameraAt("c" + std::to_string(k), 20 + 360.0 * k / count, Eigen::Vector3d::Zero()));
  return out;
}

inline double MeanDistance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double sum = 0;
  for (size_t v = 0; v < a.size(); ++v) sum += (a[v] - b[v]).norm();
  return sum / static_cast<double>(a.size());
}

}  // namespace weft
