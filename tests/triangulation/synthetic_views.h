// Cameras around a point and the views that they have of known nodes.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "triangulation/triangulate.h"

namespace weft::testing {

// `count` cameras on a ring of 2.5 m, looking at the origin from alternating heights, with real-looking
// lenses.
inline Rig RingRig(int count) {
  Rig rig;
  rig.id = "ring";
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    const Eigen::Vector3d center(2500 * std::cos(angle), 300.0 * (i % 3 - 1), 2500 * std::sin(angle));
    CameraModel camera;
    camera.id = std::to_string(400 + i);
    camera.width_px = 2668;
    camera.height_px = 4096;
    camera.fx_px = camera.fy_px = 4600 + 40 * (i % 5);
    camera.cx_px = 1185;
    camera.cy_px = 2049;
    camera.distortion = {-0.12, 0.35, 4e-4, -3e-4, -0.4};
    const Eigen::Vector3d z = -center.normalized();
    const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized() * -1;
    camera.rotation.row(0) = x;
    camera.rotation.row(1) = z.cross(x);
    camera.rotation.row(2) = z;
    camera.translation_mm = -camera.rotation * center;
    rig.cameras.push_back(camera);
  }
  return rig;
}

struct NodeTruth {
  BoardNode node;
  Eigen::Vector3d position_mm;
};

// Every node as every camera sees it, with Gaussian noise of sigma_px per axis.
inline std::vector<ViewObservations> Observe(const Rig& rig, const std::vector<NodeTruth>& nodes,
                                             double sigma_px, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  std::vector<ViewObservations> views(rig.cameras.size());
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    views[c].camera = static_cast<int>(c);
    for (const NodeTruth& truth : nodes) {
      const auto pixel = rig.cameras[c].Project(truth.position_mm);
      if (!pixel || !rig.cameras[c].Contains(*pixel)) continue;
      views[c].observations.push_back({pixel->x() + sigma_px * noise(random),
                                       pixel->y() + sigma_px * noise(random), truth.node,
                                       static_cast<float>(sigma_px), 0.99f});
    }
  }
  return views;
}

// A bent sheet of rows x cols cells of 2.7 mm around the origin; centres, or corners.
inline std::vector<NodeTruth> BentSheet(int rows, int cols, NodeKind kind = NodeKind::kCenter) {
  std::vector<NodeTruth> nodes;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      const double angle = (c - 0.5 * cols) * 2.7 / 150;
      nodes.push_back({{r, c, kind}, {150 * std::sin(angle), (r - 0.5 * rows) * 2.7, 150 * std::cos(angle)}});
    }
  }
  return nodes;
}

// A share of the observations somewhere else, some seen twice, some without a corner of the rig.
inline void Spoil(double share, std::vector<ViewObservations>* views) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (ViewObservations& view : *views) {
    std::vector<Observation> kept;
    for (Observation o : view.observations) {
      if (unit(random) < 0.3) continue;
      if (unit(random) < share) o.x_px += 300 * (unit(random) - 0.5), o.y_px += 300 * (unit(random) - 0.5);
      if (unit(random) < 0.05) o.x_px += 4 * (unit(random) - 0.5);
      kept.push_back(o);
      if (unit(random) < 0.03) kept.push_back({o.x_px + 0.3, o.y_px, o.node, o.sigma_px, o.confidence});
    }
    std::shuffle(kept.begin(), kept.end(), random);
    view.observations = kept;
  }
}

}  // namespace weft::testing
