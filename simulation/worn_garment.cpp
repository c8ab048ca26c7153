#include "simulation/worn_garment.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "simulation/body_motion.h"
#include "simulation/garment_solver.h"
#include "simulation/random.h"
#include "simulation/wardrobe.h"

namespace weft {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kGrowS = 0.6;           // the body grows into the garment,
constexpr double kLowerS = 0.5;          // lowers its arms,
constexpr double kSlowestMmPerS = 2200;  // of cloth against the trunk, sets the automatic step

// The person stands so that the garment is about the origin.
const Vector3d kPelvisMm(0, 60, 0);

double StepOf(const PerformanceOptions& o) {
  if (o.step_s > 0) return o.step_s;
  return std::min(0.002, 0.5 * o.cell_mm / kSlowestMmPerS);
}

std::vector<std::array<Eigen::Vector2d, 3>> FlatShape(const Garment& garment) {
  std::vector<std::array<Eigen::Vector2d, 3>> flat;
  for (const auto& corners : garment.print.of_face)
    flat.push_back(
        {corners[0] * garment.cell_mm, corners[1] * garment.cell_mm, corners[2] * garment.cell_mm});
  return flat;
}

class WornGarment : public PerformanceSource {
 public:
  WornGarment(const PerformanceOptions& options, Outfit outfit)
      : options_(options),
        step_s_(StepOf(options)),
        garment_(std::move(outfit.sewn.garment)),
        waist_(std::move(outfit.waist)),
        start_mm_(std::move(outfit.start_mm)),
        time_s_(-DressingS()) {
    for (Vector3d& p : start_mm_) p += kPelvisMm;
    Disturb();
    solver_.emplace(garment_.rest.faces, FlatShape(garment_), start_mm_, garment_.cell_mm, options.jersey);
    body_faces_ = Body::MeshFaces();
    if (options.motion != PerformanceMotion::kPinch) return;
    const int shift = static_cast<int>(Body(BodyPose()).MeshVertices().size());
    for (Face f : HandFaces()) body_faces_.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  }

  absl::Status Dress(const std::function<void(double)>& on_progress) {
    const double from = time_s_;
    while (time_s_ < 0) {
      const double until = std::min(0.0, time_s_ + 0.05);
      if (absl::Status status = Advance(until); !status.ok()) return status;
      if (on_progress) on_progress(1 - time_s_ / from);
    }
    garment_.rest.vertices_mm = solver_->positions_mm();
    if (options_.motion == PerformanceMotion::kPinch) ChoosePinch();
    return absl::OkStatus();
  }

  const Garment& garment() const override { return garment_; }
  const std::vector<Face>& body_faces() const override { return body_faces_; }

  absl::StatusOr<PerformanceFrame> FrameAt(int frame) override {
    const double at_s = frame / options_.fps;
    if (absl::Status status = Advance(at_s); !status.ok()) return status;
    PerformanceFrame out;
    out.time_ns = std::llround(at_s * 1e9);
    out.vertices_mm = solver_->positions_mm();
    out.velocities_mm_s = solver_->velocities_mm_s();
    constexpr double kBriefly = 1e-3;
    out.body_vertices_mm = BodyMeshAt(at_s);
    out.body_velocities_mm_s = BodyMeshAt(at_s + kBriefly);
    for (size_t v = 0; v < out.body_vertices_mm.size(); ++v)
      out.body_velocities_mm_s[v] = (out.body_velocities_mm_s[v] - out.body_vertices_mm[v]) / kBriefly;
    return out;
  }

 private:
  double DressingS() const { return kGrowS + kLowerS + options_.settle_s; }

  // A little noise breaks the symmetry of left and right; the seed decides where folds begin.
  void Disturb() {
    const uint64_t key = KeyOf(options_.seed, "disturbance");
    for (size_t v = 0; v < start_mm_.size(); ++v)
      for (int k = 0; k < 3; ++k)
        start_mm_[v][k] += 0.01 * garment_.cell_mm * (2 * UniformOf(key, 3 * v + k) - 1);
  }

  Body BodyAt(double time_s) const {
    BodyPose pose;
    double growth = 1;
    if (time_s < 0) {
      const double since = time_s + DressingS();
      growth = kDressingGrowth + (1 - kDressingGrowth) * SmoothStep(since / kGrowS);
      pose = Mix(DressingPose(), NaturalPose(), SmoothStep((since - kGrowS) / kLowerS));
    } else {
      pose = PoseAt(options_.motion, time_s, options_.seed);
    }
    pose.root_mm += kPelvisMm;
    return Body(pose, growth);
  }

  std::vector<Vector3d> BodyMeshAt(double time_s) const {
    std::vector<Vector3d> out = BodyAt(time_s).MeshVertices();
    if (options_.motion != PerformanceMotion::kPinch) return out;
    const std::vector<Vector3d> hand = HandVertices(PinchAt(time_s, pinch_at_mm_, options_.seed).hand);
    out.insert(out.end(), hand.begin(), hand.end());
    return out;
  }

  // The place that the hand takes hold of: the front, below the chest.
  void ChoosePinch() {
    const Vector3d goal = kPelvisMm + Vector3d(45, -70, -400);
    double least = 1e18;
    int nearest = 0;
    const std::vector<Vector3d>& x = solver_->positions_mm();
    for (size_t v = 0; v < x.size(); ++v) {
      if (x[v].z() > 0) continue;
      const double d = (x[v] - goal).head<2>().squaredNorm();
      if (d < least) least = d, nearest = static_cast<int>(v);
    }
    pinch_at_mm_ = x[nearest];
  }

  // While the hand holds, the vertices near its grip move with it.
  void Pinch(double time_s, StepInput& input) {
    if (options_.motion != PerformanceMotion::kPinch || time_s < 0) return;
    const PinchState state = PinchAt(time_s, pinch_at_mm_, options_.seed);
    const std::vector<Vector3d>& x = solver_->positions_mm();
    if (state.holds && held_.empty()) {
      constexpr double kGripMm = 11;
      for (size_t v = 0; v < x.size(); ++v)
        if ((x[v] - state.hand.grip_mm).norm() < std::max(kGripMm, garment_.cell_mm)) {
          held_.push_back(static_cast<int>(v));
          held_from_grip_.push_back(x[v] - state.hand.grip_mm);
        }
    }
    if (!state.holds) held_.clear(), held_from_grip_.clear();
    for (size_t k = 0; k < held_.size(); ++k) {
      input.held.push_back(held_[k]);
      input.held_at_mm.push_back(state.hand.grip_mm + held_from_grip_[k]);
    }
  }

  void HoldWaist(const Body& body, StepInput& input) const {
    for (const int v : waist_) {
      input.held.push_back(v);
      input.held_at_mm.push_back(body.world_from_pelvis() * (start_mm_[v] - kPelvisMm));
    }
  }

  absl::Status Advance(double until_s) {
    const int steps = static_cast<int>(std::ceil((until_s - time_s_) / step_s_ - 1e-9));
    const double h = steps > 0 ? (until_s - time_s_) / steps : 0;
    Body before = BodyAt(time_s_);
    for (int k = 0; k < steps; ++k) {
      time_s_ = k + 1 == steps ? until_s : time_s_ + h;
      const Body body = BodyAt(time_s_);
      Obstacle obstacle;
      obstacle.distance = [&](const Vector3d& p, double far) { return body.DistanceWithin(p, far); };
      obstacle.velocity_mm_s = [&](const Vector3d& p) -> Vector3d {
        return (p - body.PlaceIn(before, p)) / h;
      };
      StepInput input;
      input.obstacle = &obstacle;
      const auto trunk = waist_.empty() ? &Body::world_from_chest : &Body::world_from_pelvis;
      input.carry = (body.*trunk)() * (before.*trunk)().inverse();
      const double calm = std::clamp(-time_s_ / DressingS(), 0.0, 1.0);
      input.drag_per_s = 25 * calm * calm;
      if (time_s_ + DressingS() < kGrowS) input.gravity_mm_s2 *= 0.3;
      Pinch(time_s_, input);
      HoldWaist(body, input);
      solver_->Step(h, input);
      before = body;
    }
    if (!solver_->IsFinite())
      return absl::InternalError(
          absl::StrCat("cloth simulation diverged at ", until_s, " s; use a smaller step_s than ", step_s_));
    return absl::OkStatus();
  }

  PerformanceOptions options_;
  double step_s_;
  Garment garment_;
  std::vector<int> waist_;
  std::vector<Vector3d> start_mm_;
  double time_s_;
  std::optional<GarmentSolver> solver_;
  std::vector<Face> body_faces_;
  Vector3d pinch_at_mm_ = Vector3d::Zero();
  std::vector<int> held_;
  std::vector<Vector3d> held_from_grip_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<PerformanceSource>> WearGarment(
    const PerformanceOptions& options, const std::function<void(double)>& on_progress) {
  absl::StatusOr<Outfit> outfit =
      options.garment == GarmentKind::kSkirt ? MakeSkirt(options.cell_mm) : MakeTShirt(options.cell_mm);
  if (!outfit.ok()) return outfit.status();
  auto worn = std::make_unique<WornGarment>(options, *std::move(outfit));
  if (absl::Status status = worn->Dress(on_progress); !status.ok()) return status;
  return worn;
}

}  // namespace weft
