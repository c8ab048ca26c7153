#include "simulation/folded_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/angles.h"
#include "base/status_macros.h"
#include "physics/garment_solver.h"
#include "simulation/body_motion.h"
#include "simulation/folded_cloth.h"
#include "simulation/random.h"

namespace weft {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kFastestFolding_mm_per_s = 750;  // sets the automatic step
constexpr double kShapedShare =
    0.6;  // of the time to settle, within which the held vertices take their places

// What holds the cloth, and the body below it, over time; the cloth begins at -settle_s.
class Holder {
 public:
  Holder(const PerformanceOptions& options, const FoldedCloth& folded)
      : options_(options), from_mm_(folded.held_from_mm), to_mm_(folded.held_to_mm), body_(folded.body) {
    const uint64_t key = KeyOf(options.seed, "choreography");
    twist_phase_ = kTurn * UniformOf(key, 0), sway_phase_ = kTurn * UniformOf(key, 1);
    step_phase_ = kTurn * UniformOf(key, 2);
    // A sheet is moved across itself, a skirt anywhere.
    const double direction =
        kTurn * (folded.cloth.closed ? UniformOf(key, 3) : 0.25 + 0.1 * (UniformOf(key, 3) - 0.5));
    sway_direction_ = Vector3d(std::cos(direction), 0, std::sin(direction));
  }

  Isometry3d PlaceAt(double time_s) const {
    const HandleMotion& h = options_.handles;
    const double onset = SmoothStep(1 + time_s / options_.settle_s), turn = kTurn * time_s / h.period_s;
    const double twist = onset * h.twist_deg * std::numbers::pi / 180 * std::sin(turn + twist_phase_);
    Isometry3d out = Isometry3d::Identity();
    out.translate(onset * h.sway_mm * std::sin(turn + sway_phase_) * sway_direction_);
    out.rotate(Eigen::AngleAxisd(twist, Vector3d::UnitY()));
    return out;
  }

  std::vector<Vector3d> HeldAt(double time_s) const {
    const Isometry3d place = PlaceAt(time_s);
    const double share = SmoothStep((1 + time_s / options_.settle_s) / kShapedShare);
    std::vector<Vector3d> out;
    for (size_t k = 0; k < to_mm_.size(); ++k)
      out.push_back(place * ((1 - share) * from_mm_[k] + share * to_mm_[k]));
    return out;
  }

  size_t body_parts() const { return body_.size(); }
  Isometry3d PartPlaceAt(size_t part, double time_s) const {
    const SwingingCapsule& p = body_[part];
    const double onset = SmoothStep(1 + time_s / options_.settle_s);
    const double turn = kTurn * time_s / options_.handles.period_s + step_phase_;
    Isometry3d swing = Isometry3d::Identity();
    swing.translate(p.pivot_mm);
    swing.rotate(Eigen::AngleAxisd(onset * p.swing_rad * std::sin(turn), Vector3d::UnitX()));
    swing.translate(-p.pivot_mm);
    return PlaceAt(time_s) * swing;
  }
  const Capsule& PartShape(size_t part) const { return body_[part].capsule; }

 private:
  PerformanceOptions options_;
  std::vector<Vector3d> from_mm_, to_mm_;
  std::vector<SwingingCapsule> body_;
  double twist_phase_ = 0, sway_phase_ = 0, step_phase_ = 0;
  Vector3d sway_direction_;
};

// The body during a step.
class MovingBody {
 public:
  MovingBody(const Holder& holder, double from_s, double to_s) : step_s_(to_s - from_s) {
    for (size_t p = 0; p < holder.body_parts(); ++p) {
      const Isometry3d before = holder.PartPlaceAt(p, from_s), place = holder.PartPlaceAt(p, to_s);
      Capsule shape = holder.PartShape(p);
      shape.a = place * shape.a, shape.b = place * shape.b;
      parts_.push_back({shape, before * place.inverse()});
    }
  }
  bool empty() const { return parts_.empty(); }
  SurfaceDistance DistanceAt(const Vector3d& p) const { return weft::DistanceTo(Nearest(p).shape, p); }
  Vector3d VelocityAt(const Vector3d& p) const { return (p - Nearest(p).earlier_from_now * p) / step_s_; }

 private:
  struct Part {
    Capsule shape;
    Isometry3d earlier_from_now;
  };
  const Part& Nearest(const Vector3d& p) const {
    double least = std::numeric_limits<double>::infinity();
    size_t nearest = 0;
    for (size_t k = 0; k < parts_.size(); ++k)
      if (const double d = weft::DistanceTo(parts_[k].shape, p).distance_mm; d < least)
        least = d, nearest = k;
    return parts_[nearest];
  }

  double step_s_;
  std::vector<Part> parts_;
};

class FoldedPerformance : public PerformanceSource {
 public:
  FoldedPerformance(const PerformanceOptions& options, FoldedCloth folded)
      : options_(options),
        step_s_(StepOf(options, kFastestFolding_mm_per_s)),
        holder_(options, folded),
        held_(folded.held),
        time_s_(-options.settle_s),
        solver_(folded.cloth.rest.faces, FlatShape(folded.cloth), folded.start_mm, options.cell_mm,
                options.jersey, folded.creases),
        garment_{options.rows,
                 options.cols,
                 options.cell_mm,
                 std::move(folded.cloth.rest),
                 std::move(folded.cloth.cell_of_vertex),
                 std::move(folded.cloth.print)} {
    for (size_t p = 0; p < holder_.body_parts(); ++p)
      AppendCapsuleFaces(static_cast<int>(p) * CapsuleVertexCount(), body_faces_);
  }

  const Garment& garment() const override { return garment_; }
  const std::vector<Face>& body_faces() const override { return body_faces_; }

  absl::Status Settle(const std::function<void(double)>& on_progress) {
    while (time_s_ < 0) {
      WEFT_RETURN_IF_ERROR(Advance(std::min(0.0, time_s_ + 0.05)));
      if (on_progress) on_progress(1 + time_s_ / options_.settle_s);
    }
    return absl::OkStatus();
  }

  absl::StatusOr<PerformanceFrame> FrameAt(int frame) override {
    const double at_s = frame / options_.fps;
    WEFT_RETURN_IF_ERROR(Advance(at_s));
    PerformanceFrame out;
    out.time_ns = std::llround(frame * 1e9 / options_.fps);
    out.vertices_mm = solver_.positions_mm();
    out.velocities_mm_s = solver_.velocities_mm_s();
    constexpr double kBriefly = 1e-3;
    out.body_vertices_mm = BodyAt(at_s);
    out.body_velocities_mm_s = BodyAt(at_s + kBriefly);
    for (size_t v = 0; v < out.body_vertices_mm.size(); ++v)
      out.body_velocities_mm_s[v] = (out.body_velocities_mm_s[v] - out.body_vertices_mm[v]) / kBriefly;
    return out;
  }

 private:
  std::vector<Vector3d> BodyAt(double time_s) const {
    std::vector<Vector3d> out;
    for (size_t p = 0; p < holder_.body_parts(); ++p) {
      const Isometry3d place = holder_.PartPlaceAt(p, time_s);
      for (const Vector3d& v : CapsuleVertices(holder_.PartShape(p))) out.push_back(place * v);
    }
    return out;
  }

  absl::Status Advance(double until_s) {
    const int steps = StepsWithin(until_s - time_s_, step_s_);
    const double h = (until_s - time_s_) / std::max(1, steps);
    for (int k = 0; k < steps; ++k) {
      const double before_s = time_s_;
      time_s_ += h;
      const MovingBody body(holder_, before_s, time_s_);
      Obstacle obstacle;
      obstacle.distance = [&](const Vector3d& p, double) { return body.DistanceAt(p); };
      obstacle.velocity_mm_s = [&](const Vector3d& p) { return body.VelocityAt(p); };
      StepInput input;
      if (!body.empty()) input.obstacle = &obstacle;
      input.carry = holder_.PlaceAt(time_s_) * holder_.PlaceAt(before_s).inverse();
      input.held = held_;
      input.held_at_mm = holder_.HeldAt(time_s_);
      const double calm = std::clamp(-time_s_ / options_.settle_s, 0.0, 1.0);
      input.drag_per_s = 25 * calm * calm;
      solver_.Step(h, input);
    }
    time_s_ = until_s;
    if (solver_.IsFinite()) return absl::OkStatus();
    return absl::InternalError(
        absl::StrCat("cloth simulation diverged at ", until_s, " s; use a smaller step_s than ", step_s_));
  }

  PerformanceOptions options_;
  double step_s_;
  Holder holder_;
  std::vector<int> held_;
  double time_s_;
  GarmentSolver solver_;
  Garment garment_;
  std::vector<Face> body_faces_;
};

absl::StatusOr<FoldedCloth> Make(const PerformanceOptions& options) {
  if (options.garment == GarmentKind::kPleatedSkirt) return MakePleatedSkirt(options);
  if (options.garment == GarmentKind::kGatheredSkirt) return MakeGatheredSkirt(options);
  return MakeCurlingSheet(options);
}

}  // namespace

bool IsFolded(GarmentKind kind) {
  return kind == GarmentKind::kPleatedSkirt || kind == GarmentKind::kGatheredSkirt ||
         kind == GarmentKind::kCurlingSheet;
}

absl::StatusOr<std::unique_ptr<PerformanceSource>> MoveFoldedCloth(
    const PerformanceOptions& options, const std::function<void(double)>& on_progress) {
  WEFT_ASSIGN_OR_RETURN(FoldedCloth folded, Make(options));
  auto moved = std::make_unique<FoldedPerformance>(options, std::move(folded));
  WEFT_RETURN_IF_ERROR(moved->Settle(on_progress));
  return moved;
}

}  // namespace weft
