#include "simulation/hung_cloth.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"
#include "base/angles.h"
#include "base/status_macros.h"
#include "physics/garment_solver.h"
#include "simulation/body_motion.h"
#include "simulation/random.h"

namespace weft {
namespace {

using Eigen::Vector3d;

constexpr double kFastestHung_mm_per_s = 750;  // sets the automatic step
constexpr double kBodyShare = 0.8;             // radius of the body in a tube, relative to the tube's

// The rest state displaced along its normals by a fraction of a cell, so that folds have a place to begin.
std::vector<Vector3d> Disturbed(const Cloth& cloth, uint64_t seed) {
  const uint64_t key = KeyOf(seed, "disturbance");
  std::vector<Vector3d> x = cloth.rest.vertices_mm;
  const std::vector<Vector3d> normals = VertexNormals(x, cloth.rest.faces);
  const double size = cloth.options.cell_mm;
  // A few smooth waves decide where folds begin, a little noise breaks what symmetry remains.
  for (size_t i = 0; i < x.size(); ++i) {
    double wave = 0.02 * size * NormalOf(key, 100 + i);
    for (uint64_t k = 0; k < 6; ++k) {
      const double fx = 3 + 5 * UniformOf(key, 4 * k), fy = 2 + 4 * UniformOf(key, 4 * k + 1);
      const double around = cloth.closed ? std::round(fx) * std::atan2(x[i].x(), -x[i].z())
                                         : fx * x[i].x() / (cloth.options.cols * size) * kTurn;
      wave += 0.04 * size *
              std::sin(around + fy * kTurn * x[i].y() / (cloth.options.rows * size) +
                       kTurn * UniformOf(key, 4 * k + 2));
    }
    x[i] += wave * normals[i];
  }
  return x;
}

// The vertices that are held, and where they are over time; rest is at -settle_s.
class Handles {
 public:
  Handles(const Cloth& cloth, const PerformanceOptions& options) : options_(options), closed_(cloth.closed) {
    const auto add_row = [&](int i, int gaps) {
      for (int k = 0; k <= gaps; ++k)
        vertices_.push_back(cloth.vertex_at(i, k * (cloth.grid_cols - 1) / gaps));
    };
    // A sheet hangs from hooks about six cells apart, both ends included.
    add_row(0, closed_ ? cloth.grid_cols - 1 : std::max(2, (cloth.grid_cols - 1) / 6));
    upper_ = vertices_.size();
    if (closed_) add_row(cloth.grid_rows - 1, cloth.grid_cols - 1);
    for (const int v : vertices_) rest_mm_.push_back(cloth.rest.vertices_mm[v]);
    height_mm_ = cloth.options.rows * cloth.options.cell_mm;
    const uint64_t key = KeyOf(options.seed, "choreography");
    twist_phase_ = kTurn * UniformOf(key, 0), sway_phase_ = kTurn * UniformOf(key, 1);
    compression_phase_ = kTurn * UniformOf(key, 2);
    const double direction = kTurn * UniformOf(key, 3);
    sway_direction_ = Vector3d(std::cos(direction), 0, std::sin(direction));
    for (size_t k = 0; k < vertices_.size(); ++k)
      pleat_z_mm_.push_back((k % 2 == 0 ? 1 : -1) * cloth.options.cell_mm *
                            (0.8 + 0.6 * UniformOf(key, 10 + k)));
  }

  const std::vector<int>& vertices() const { return vertices_; }

  std::vector<Vector3d> At(double time_s) const {
    const HandleMotion& h = options_.handles;
    const double onset = OnsetAt(time_s), turn = kTurn * time_s / h.period_s;
    const double closer = onset * h.compression * (0.85 + 0.15 * std::sin(turn + compression_phase_));
    const double twist = onset * h.twist_deg * std::numbers::pi / 180 * std::sin(turn + twist_phase_);
    std::vector<Vector3d> out;
    for (size_t k = 0; k < vertices_.size(); ++k) {
      Vector3d p = rest_mm_[k];
      if (closed_) {
        // The upper end turns and sinks against the lower one, by half of each.
        const double side = k < upper_ ? 0.5 : -0.5;
        p = Eigen::AngleAxisd(side * twist, Vector3d::UnitY()) * p;
        p.y() += side * closer * height_mm_;
      } else {
        p = Vector3d(p.x() * (1 - closer), p.y(), onset * pleat_z_mm_[k]);
      }
      out.push_back(p + SwayAt(time_s));
    }
    return out;
  }

  // The body in a tube sways with the handles.
  Vector3d SwayAt(double time_s) const {
    return OnsetAt(time_s) * options_.handles.sway_mm *
           std::sin(kTurn * time_s / options_.handles.period_s + sway_phase_) * sway_direction_;
  }

 private:
  double OnsetAt(double time_s) const {
    return SmoothStep((time_s + options_.settle_s) / (0.75 * options_.settle_s));
  }

  PerformanceOptions options_;
  bool closed_;
  std::vector<int> vertices_;
  size_t upper_ = 0;  // the first `upper_` belong to the upper border
  std::vector<Vector3d> rest_mm_;
  double height_mm_ = 0;
  double twist_phase_ = 0, sway_phase_ = 0, compression_phase_ = 0;
  Vector3d sway_direction_;
  std::vector<double> pleat_z_mm_;  // sheet: depth of each handle
};

class HungCloth : public PerformanceSource {
 public:
  HungCloth(const PerformanceOptions& options, Cloth cloth)
      : options_(options),
        step_s_(StepOf(options, kFastestHung_mm_per_s)),
        handles_(cloth, options),
        body_radius_mm_(cloth.closed ? kBodyShare * options.cols * options.cell_mm / kTurn : 0),
        time_s_(-options.settle_s),
        solver_(cloth.rest.faces, FlatShape(cloth), Disturbed(cloth, options.seed), options.cell_mm,
                options.jersey),
        garment_{options.rows,
                 options.cols,
                 options.cell_mm,
                 std::move(cloth.rest),
                 std::move(cloth.cell_of_vertex),
                 std::move(cloth.print)} {}

  const Garment& garment() const override { return garment_; }
  const std::vector<Face>& body_faces() const override { return no_faces_; }

  absl::Status Settle(const std::function<void(double)>& on_progress) {
    while (time_s_ < 0) {
      WEFT_RETURN_IF_ERROR(Advance(std::min(0.0, time_s_ + 0.05)));
      if (on_progress) on_progress(1 + time_s_ / options_.settle_s);
    }
    return absl::OkStatus();
  }

  absl::StatusOr<PerformanceFrame> FrameAt(int frame) override {
    WEFT_RETURN_IF_ERROR(Advance(frame / options_.fps));
    PerformanceFrame out;
    out.time_ns = std::llround(frame * 1e9 / options_.fps);
    out.vertices_mm = solver_.positions_mm();
    out.velocities_mm_s = solver_.velocities_mm_s();
    return out;
  }

 private:
  absl::Status Advance(double until_s) {
    const int steps = StepsWithin(until_s - time_s_, step_s_);
    const double h = (until_s - time_s_) / std::max(1, steps);
    for (int k = 0; k < steps; ++k) {
      const Vector3d before_mm = handles_.SwayAt(time_s_);
      time_s_ += h;
      const Vector3d sway_mm = handles_.SwayAt(time_s_), velocity_mm_s = (sway_mm - before_mm) / h;
      Obstacle body;
      body.distance = [&](const Vector3d& p, double) -> SurfaceDistance {
        const Vector3d out(p.x() - sway_mm.x(), 0, p.z() - sway_mm.z());
        const double radius = std::max(out.norm(), 1e-9);
        return {radius - body_radius_mm_, out / radius};
      };
      body.velocity_mm_s = [&](const Vector3d&) { return velocity_mm_s; };
      StepInput input;
      if (body_radius_mm_ > 0) input.obstacle = &body;
      input.carry.translation() = sway_mm - before_mm;
      input.held = handles_.vertices();
      input.held_at_mm = handles_.At(time_s_);
      solver_.Step(h, input);
    }
    time_s_ = until_s;
    if (solver_.IsFinite()) return absl::OkStatus();
    return absl::InternalError(
        absl::StrCat("cloth simulation diverged at ", until_s, " s; use a smaller step_s than ", step_s_));
  }

  PerformanceOptions options_;
  double step_s_;
  Handles handles_;
  double body_radius_mm_;
  double time_s_;
  GarmentSolver solver_;
  Garment garment_;
  std::vector<Face> no_faces_;
};

}  // namespace

ClothOptions ClothOptionsOf(const PerformanceOptions& o) {
  ClothOptions out;
  out.shape = o.garment == GarmentKind::kSheet || o.garment == GarmentKind::kCurlingSheet ? ClothShape::kSheet
                                                                                          : ClothShape::kTube;
  out.rows = o.rows, out.cols = o.cols, out.cell_mm = o.cell_mm;
  return out;
}

absl::StatusOr<std::unique_ptr<PerformanceSource>> HangCloth(const PerformanceOptions& options,
                                                             const std::function<void(double)>& on_progress) {
  WEFT_ASSIGN_OR_RETURN(Cloth cloth, BuildCloth(ClothOptionsOf(options)));
  auto hung = std::make_unique<HungCloth>(options, std::move(cloth));
  WEFT_RETURN_IF_ERROR(hung->Settle(on_progress));
  return hung;
}

}  // namespace weft
