#include "simulation/cloth_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "simulation/cloth_solver.h"
#include "simulation/random.h"

namespace weft {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

double SmoothStep(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// What the seed decides about the handles.
struct Choreography {
  double twist_phase, sway_phase, compression_phase, sway_direction;
  std::vector<double> pleat_z_mm;  // sheet: depth of each handle
};

struct Handles {
  std::vector<int> vertices;
  int upper = 0;  // the first `upper` belong to the upper border
};

Handles ChooseHandles(const Cloth& cloth) {
  Handles out;
  if (cloth.closed) {
    for (int j = 0; j < cloth.grid_cols; ++j) out.vertices.push_back(cloth.vertex_at(0, j));
    out.upper = cloth.grid_cols;
    for (int j = 0; j < cloth.grid_cols; ++j) out.vertices.push_back(cloth.vertex_at(cloth.grid_rows - 1, j));
    return out;
  }
  // A sheet hangs from hooks about six cells apart, both ends included.
  const int gaps = std::max(2, (cloth.grid_cols - 1) / 6);
  for (int k = 0; k <= gaps; ++k)
    out.vertices.push_back(cloth.vertex_at(0, k * (cloth.grid_cols - 1) / gaps));
  out.upper = static_cast<int>(out.vertices.size());
  return out;
}

Choreography ChooseChoreography(const Handles& handles, const MotionOptions& options, double cell_mm) {
  const uint64_t key = KeyOf(options.seed, "choreography");
  Choreography out;
  out.twist_phase = kTurn * UniformOf(key, 0);
  out.sway_phase = kTurn * UniformOf(key, 1);
  out.compression_phase = kTurn * UniformOf(key, 2);
  out.sway_direction = kTurn * UniformOf(key, 3);
  for (size_t k = 0; k < handles.vertices.size(); ++k) {
    const double side = k % 2 == 0 ? 1 : -1;
    out.pleat_z_mm.push_back(side * cell_mm * (0.8 + 0.6 * UniformOf(key, 10 + k)));
  }
  return out;
}

// Positions of the handles at time `t_s`; the first frame is at 0, rest at -settle_s.
std::vector<Eigen::Vector3d> HandlePositions(const Cloth& cloth, const Handles& handles,
                                             const MotionOptions& o, const Choreography& plan, double t_s) {
  const double onset = SmoothStep((t_s + o.settle_s) / (0.75 * o.settle_s));
  const double turn = kTurn * t_s / o.period_s;
  const double compression = onset * o.compression * (0.85 + 0.15 * std::sin(turn + plan.compression_phase));
  const double twist = onset * o.twist_deg * std::numbers::pi / 180 * std::sin(turn + plan.twist_phase);
  const double sway = onset * o.sway_mm * std::sin(turn + plan.sway_phase);
  const Eigen::Vector3d shift(sway * std::cos(plan.sway_direction), 0, sway * std::sin(plan.sway_direction));
  const double height = cloth.options.rows * cloth.options.cell_mm;

  std::vector<Eigen::Vector3d> out;
  out.reserve(handles.vertices.size());
  for (size_t k = 0; k < handles.vertices.size(); ++k) {
    Eigen::Vector3d p = cloth.rest.vertices_mm[handles.vertices[k]];
    if (!cloth.closed) {
      p = Eigen::Vector3d(p.x() * (1 - compression), p.y(), onset * plan.pleat_z_mm[k]) + shift;
    } else if (static_cast<int>(k) < handles.upper) {
      // The tube's upper end turns and sinks against the lower one, by half of each.
      const double a = twist / 2;
      p = Eigen::Vector3d(std::cos(a) * p.x() + std::sin(a) * p.z(), p.y() + compression * height / 2,
                          -std::sin(a) * p.x() + std::cos(a) * p.z());
    } else {
      const double a = -twist / 2;
      p = Eigen::Vector3d(std::cos(a) * p.x() + std::sin(a) * p.z(), p.y() - compression * height / 2,
                          -std::sin(a) * p.x() + std::cos(a) * p.z());
    }
    out.push_back(p);
  }
  return out;
}

// Displaces the rest state along its normals by a fraction of a cell, so that folds have a place to begin.
void Disturb(const Cloth& cloth, uint64_t seed, std::vector<Eigen::Vector3d>& x) {
  const uint64_t key = KeyOf(seed, "disturbance");
  const std::vector<Eigen::Vector3d> normals = VertexNormals(x, cloth.rest.faces);
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
}

}  // namespace

absl::Status MotionOptions::Validate() const {
  const auto bad = [](const char* field, double value, const char* expected) {
    return absl::InvalidArgumentError(
        absl::StrCat("motion: ", field, " is ", value, ", expected ", expected));
  };
  if (frames < 1 || frames > 100000) return bad("frames", frames, "1 to 100000");
  if (!(fps > 0 && fps <= 1000)) return bad("fps", fps, "0 to 1000");
  if (!(period_s > 0.05)) return bad("period_s", period_s, "at least 0.05");
  if (!(settle_s >= 0.1)) return bad("settle_s", settle_s, "at least 0.1");
  if (!(compression >= 0 && compression <= 0.5)) return bad("compression", compression, "0 to 0.5");
  if (!(std::abs(twist_deg) <= 90)) return bad("twist_deg", twist_deg, "-90 to 90");
  if (!std::isfinite(sway_mm)) return bad("sway_mm", sway_mm, "a number");
  if (!(step_s > 0 && step_s <= 0.002)) return bad("step_s", step_s, "0 to 0.002");
  if (!(fabric.density_kg_m2 > 0)) return bad("density_kg_m2", fabric.density_kg_m2, "a positive number");
  if (!(fabric.bending_n_m > 0)) return bad("bending_n_m", fabric.bending_n_m, "a positive number");
  if (!(fabric.shear_n_per_m > 0)) return bad("shear_n_per_m", fabric.shear_n_per_m, "a positive number");
  if (!(fabric.thickness_cells >= 0.75 && fabric.thickness_cells <= 1))
    return bad("thickness_cells", fabric.thickness_cells, "0.75 to 1 (below, layers could pass each other)");
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::vector<Eigen::Vector3d>>> SimulateMotion(
    const Cloth& cloth, const MotionOptions& options, const std::function<void(int)>& on_frame) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  ClothSolver solver(cloth, options.fabric);
  const Handles handles = ChooseHandles(cloth);
  const Choreography plan = ChooseChoreography(handles, options, cloth.options.cell_mm);
  solver.Pin(handles.vertices);
  if (cloth.closed) {
    const double radius = cloth.options.cols * cloth.options.cell_mm / kTurn;
    solver.SetBodyRadius(0.8 * radius);
  }
  Disturb(cloth, options.seed, solver.positions_mm());

  std::vector<std::vector<Eigen::Vector3d>> frames;
  const Eigen::Vector3d gravity(0, options.gravity_mm_s2, 0);
  const auto steps_until = [&](double time_s) {
    return static_cast<int64_t>(std::ceil((time_s + options.settle_s) / options.step_s - 1e-9));
  };
  int64_t step = 0;
  for (int frame = 0; frame < options.frames; ++frame) {
    const int64_t end = steps_until(frame / options.fps);
    for (; step < end; ++step) {
      const double t_s = (step + 1) * options.step_s - options.settle_s;
      solver.Step(options.step_s, gravity, HandlePositions(cloth, handles, options, plan, t_s));
    }
    if (!solver.IsFinite()) {
      return absl::InternalError(absl::StrCat("cloth simulation diverged before frame ", frame,
                                              "; use a smaller step_s than ", options.step_s));
    }
    frames.push_back(solver.positions_mm());
    if (on_frame) on_frame(frame + 1);
  }
  if (cloth.closed) {
    // The tube is simulated in the frame of its body; the sway moves both.
    for (int frame = 0; frame < options.frames; ++frame) {
      const double turn = kTurn * frame / options.fps / options.period_s;
      const double sway = options.sway_mm * std::sin(turn + plan.sway_phase);
      const Eigen::Vector3d shift(sway * std::cos(plan.sway_direction), 0,
                                  sway * std::sin(plan.sway_direction));
      for (Eigen::Vector3d& p : frames[frame]) p += shift;
    }
  }
  return frames;
}

}  // namespace weft
