// A tube of cloth of a shirt's size that waves, its avatar, and what two cameras see of it.
#pragma once

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "alignment/mesh_graph.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/sparse_view/sigma_calibration.h"
#include "base/counter_random.h"
#include "pattern/board/board_index.h"
#include "services/work/animation/truth_views.h"
#include "simulation/cloth.h"
#include "simulation/renderer.h"

namespace weft::testing {

class WavingCloth {
 public:
  static constexpr int kMoments = 8;  // there and back again
  static constexpr int kWaves = 16, kComponents = 48;

  // As wide and high as a T-shirt's trunk, of n x n cells.
  explicit WavingCloth(int n) {
    ClothOptions options;
    options.rows = options.cols = n;
    options.cell_mm = 846.0 / n;
    cloth_ = *BuildCloth(options);
    board_ = *GenerateBoard(n + 8, n + 8, options.cell_mm, 7);
    garment_.id = "waving";
    garment_.board_hash = board_.ContentHash();
    garment_.rest = cloth_.rest;
    garment_.node_of_vertex = cloth_.cell_of_vertex;
    const TruthViews views(garment_, BodyShape());
    rig_ = *DrivingRig(2, cloth_.rest.vertices_mm, 1);
    for (int k = 0; k < kMoments; ++k) {
      truth_.push_back(At(0.05 * k + 1000));
      observations_.push_back(*views.Observe({0, truth_.back(), {}}, rig_, static_cast<uint64_t>(k)));
    }
    Learn();
  }

  const Template& garment() const { return garment_; }
  const SparseViewAvatar& avatar() const { return avatar_; }
  const Rig& rig() const { return rig_; }
  const Board& board() const { return board_; }
  const std::vector<Eigen::Vector3d>& truth(int moment) const { return truth_[Folded(moment)]; }
  const std::vector<ViewObservations>& observations(int moment) const {
    return observations_[Folded(moment)];
  }

  // Pictures of both cameras, lit and with noise.
  std::array<Frame, 2> Film(int moment) const {
    const StudioScene scene = *StudioScene::Build({{truth(moment), cloth_.rest.faces}, {}}, cloth_.print,
                                                  board_, {}, StudioOptions());
    std::array<Frame, 2> out;
    for (size_t c = 0; c < 2; ++c) out[c] = ToFrame(*RenderView(scene, rig_.cameras[c], {}, moment));
    return out;
  }

 private:
  static size_t Folded(int moment) {
    const int at = moment % (2 * kMoments - 2);
    return static_cast<size_t>(std::min(at, 2 * kMoments - 2 - at));
  }

  // Broad waves that a shape space knows, and wrinkles that it does not.
  std::vector<Eigen::Vector3d> At(double time) const {
    std::vector<Eigen::Vector3d> out = cloth_.rest.vertices_mm;
    for (Eigen::Vector3d& p : out) {
      const double around = std::atan2(p.x(), -p.z()), radius = std::hypot(p.x(), p.z());
      double off = 0.8 * std::sin(9 * around + 0.06 * p.y() + 5 * time);
      for (int w = 1; w <= kWaves; ++w)
        off += 8.0 / std::sqrt(w) * std::sin((0.3 + 0.21 * w) * time + 1.7 * w) *
               std::sin((w % 5) * around + 0.002 * w * p.y() + w);
      p.x() *= 1 + off / radius, p.z() *= 1 + off / radius;
      p += Eigen::Vector3d(20 * std::sin(time), 0, 15 * std::cos(0.7 * time));
    }
    return out;
  }

  void Learn() {
    const MeshGraph graph = BuildMeshGraph(garment_.rest);
    constexpr int kFrames = 80;
    const MeshFrames frames{kFrames, [this](int frame) { return At(3.1 * frame); }};
    avatar_.space = *LearnShapeSpace(frames, {.components = kComponents});
    avatar_.template_hash = garment_.ContentHash();
    avatar_.board_hash = garment_.board_hash;
    avatar_.training_frames = kFrames;
    avatar_.training.components = kComponents;
    avatar_.acceleration.assign(static_cast<size_t>(avatar_.space.components()), 0.1f);
    // The waves stretch the cloth, as its shapes do; wrinkles hardly do.
    avatar_.edge_mm.assign(graph.edges.size(), 0);
    for (int k = 0; k < kFrames; ++k) {
      const std::vector<Eigen::Vector3d> x = At(3.1 * k);
      for (size_t e = 0; e < graph.edges.size(); ++e)
        avatar_.edge_mm[e] +=
            static_cast<float>((x[graph.edges[e].a] - x[graph.edges[e].b]).norm() / kFrames);
    }
    avatar_.edge_follow.assign(graph.edges.size(), 1);
    for (const float mean_mm : avatar_.edge_mm) avatar_.edge_spread_mm.push_back(0.01f * mean_mm);
    avatar_.left_mm.assign(garment_.rest.vertices_mm.size(), 1);
    avatar_.sigma = TypicalSigmaScale();
  }

  Cloth cloth_;
  Board board_;
  Template garment_;
  Rig rig_;
  SparseViewAvatar avatar_;
  std::vector<std::vector<Eigen::Vector3d>> truth_;
  std::vector<std::vector<ViewObservations>> observations_;
};

}  // namespace weft::testing
