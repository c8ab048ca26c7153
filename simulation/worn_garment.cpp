#include "simulation/worn_garment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "alignment/untangle/untangle.h"
#include "base/status_macros.h"
#include "figure/hand.h"
#include "figure/joint_angles.h"
#include "physics/garment_solver.h"
#include "simulation/body_motion.h"
#include "simulation/random.h"
#include "simulation/state_archive.h"
#include "simulation/wardrobe.h"
#include "simulation/worn_together.h"

namespace weft {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kGrowS = 0.6;           // the body grows into the garment,
constexpr double kLowerS = 0.5;          // lowers its arms,
constexpr double kFinelyPutOnMm = 3.1;   // smaller cells are put on in a garment of twice the cells, refined
constexpr double kRefinedSettleS = 0.1;  // and come to rest within this time
constexpr double kTakeUpS = 0.8;         // a person takes up a clip within this time
constexpr double kFastestWorn_mm_per_s = 1800;  // of cloth against the trunk, sets the automatic step

// The person stands so that the garment is about the origin.
const Vector3d kPelvisMm(0, 60, 0);

std::vector<std::array<Eigen::Vector2d, 3>> FlatShape(const Garment& garment) {
  std::vector<std::array<Eigen::Vector2d, 3>> flat;
  for (const auto& corners : garment.print.of_face)
    flat.push_back(
        {corners[0] * garment.cell_mm, corners[1] * garment.cell_mm, corners[2] * garment.cell_mm});
  return flat;
}

// What the cloth lies on and is touched by.
struct Solid {
  Body body;
  std::optional<Hand> hand;

  SurfaceDistance DistanceWithin(const Vector3d& p, double far_mm) const {
    const SurfaceDistance d = body.DistanceWithin(p, far_mm);
    if (!hand || !hand->IsWithin(p, far_mm)) return d;
    const SurfaceDistance e = hand->DistanceTo(p);
    return e.distance_mm < d.distance_mm ? e : d;
  }
  // Where the part nearest to `p` had that point before.
  Vector3d PlaceIn(const Solid& before, const Vector3d& p) const {
    const bool on_hand = hand && hand->DistanceTo(p).distance_mm < body.DistanceTo(p).distance_mm;
    if (!on_hand) return body.PlaceIn(before.body, p);
    return before.hand ? hand->PlaceIn(*before.hand, p) : p;
  }
};

class WornPerformance : public PerformanceSource {
 public:
  // Spread around a thin body, or worn already (`worn_mm`, [vertices], free of self-intersections).
  WornPerformance(const PerformanceOptions& options, Outfit outfit, std::vector<Vector3d> worn_mm = {})
      : options_(options),
        step_s_(StepOf(options, kFastestWorn_mm_per_s)),
        garment_(std::move(outfit.sewn.garment)),
        waist_(std::move(outfit.waist)),
        start_mm_(std::move(outfit.start_mm)),
        time_s_(worn_mm.empty() ? -DressingS() : -std::min(kRefinedSettleS, options.settle_s)) {
    for (Vector3d& p : start_mm_) p += kPelvisMm;
    if (worn_mm.empty()) {
      Disturb();
      worn_mm = start_mm_;
    }
    solver_.emplace(garment_.rest.faces, FlatShape(garment_), std::move(worn_mm), garment_.cell_mm,
                    options.jersey);
    body_faces_ = Body::MeshFaces();
    if (!ShowsHand()) return;
    const int shift = static_cast<int>(Body(BodyPose()).MeshVertices().size());
    for (Face f : Hand::MeshFaces()) body_faces_.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  }

  absl::Status Dress(const std::function<void(double)>& on_progress) {
    const double from = time_s_;
    while (time_s_ < 0) {
      const double until = std::min(0.0, time_s_ + 0.05);
      WEFT_RETURN_IF_ERROR(Advance(until));
      if (on_progress) on_progress(1 - time_s_ / from);
    }
    garment_.rest.vertices_mm = solver_->positions_mm();
    if (ShowsHand()) ChoosePinch();
    return absl::OkStatus();
  }

  const Garment& garment() const override { return garment_; }
  const std::vector<Face>& body_faces() const override { return body_faces_; }

  std::string SaveState() override {
    StateWriter writer;
    State(writer);
    return writer.bytes();
  }
  absl::Status Restore(std::string_view state) {
    const size_t vertices = solver_->positions_mm().size();
    StateReader reader(state);
    State(reader);
    if (reader.Complete() && solver_->positions_mm().size() == vertices &&
        garment_.rest.vertices_mm.size() == vertices)
      return absl::OkStatus();
    return absl::DataLossError("performance: the saved state is of another build or garment; start anew");
  }

  absl::StatusOr<PerformanceFrame> FrameAt(int frame) override {
    const double at_s = frame / options_.fps;
    WEFT_RETURN_IF_ERROR(Advance(at_s));
    PerformanceFrame out;
    out.time_ns = std::llround(frame * 1e9 / options_.fps);
    out.vertices_mm = solver_->positions_mm();
    out.velocities_mm_s = solver_->velocities_mm_s();
    constexpr double kBriefly = 1e-3;
    if (options_.clip) out.pose = ClipPoseAt(at_s);
    out.body_vertices_mm = BodyMeshAt(at_s);
    out.body_velocities_mm_s = BodyMeshAt(at_s + kBriefly);
    for (size_t v = 0; v < out.body_vertices_mm.size(); ++v)
      out.body_velocities_mm_s[v] = (out.body_velocities_mm_s[v] - out.body_vertices_mm[v]) / kBriefly;
    return out;
  }

 private:
  template <typename Archive>
  void State(Archive& archive) {
    archive(garment_.rest.vertices_mm), archive(time_s_), archive(pinch_at_mm_), archive(pinched_),
        archive(held_);
    solver_->State(archive);
  }

  double DressingS() const { return kGrowS + kLowerS + options_.settle_s; }

  // A little noise breaks the symmetry of left and right; the seed decides where folds begin.
  void Disturb() {
    const uint64_t key = KeyOf(options_.seed, "disturbance");
    for (size_t v = 0; v < start_mm_.size(); ++v)
      for (int k = 0; k < 3; ++k)
        start_mm_[v][k] += 0.01 * garment_.cell_mm * (2 * UniformOf(key, 3 * v + k) - 1);
  }

  bool ShowsHand() const { return !options_.clip && HasHand(options_.motion); }

  // Of the person at the clip's own place in the world.
  FigurePose ClipPoseAt(double time_s) const {
    FigurePose pose =
        Mix(PoseOf(NaturalAngles()), options_.clip->PoseAt(time_s), SmoothStep(time_s / kTakeUpS));
    pose.root_mm += kPelvisMm;
    return pose;
  }

  Body BodyAt(double time_s) const {
    BodyPose pose;
    double growth = 1;
    if (time_s < 0) {
      const double since = time_s + DressingS();
      growth = kDressingGrowth + (1 - kDressingGrowth) * SmoothStep(since / kGrowS);
      pose = Mix(DressingPose(), NaturalPose(), SmoothStep((since - kGrowS) / kLowerS));
    } else {
      if (options_.clip) return Body(ClipPoseAt(time_s), options_.body);
      pose = PoseAt(options_.motion, time_s, options_.seed);
    }
    pose.root_mm += kPelvisMm;
    return Body(pose, growth, options_.body);
  }

  // No hand while the garment is put on.
  std::optional<PinchState> PinchStateAt(double time_s) const {
    if (!ShowsHand() || time_s < 0) return std::nullopt;
    return PinchAt(options_.motion, time_s, pinch_at_mm_, options_.seed);
  }

  Solid SolidAt(double time_s) const {
    Solid out = {BodyAt(time_s), std::nullopt};
    if (const auto state = PinchStateAt(time_s)) out.hand.emplace(state->hand);
    return out;
  }

  std::vector<Vector3d> BodyMeshAt(double time_s) const {
    std::vector<Vector3d> out = BodyAt(time_s).MeshVertices();
    if (const auto state = PinchStateAt(time_s)) {
      const std::vector<Vector3d> hand = Hand(state->hand).MeshVertices();
      out.insert(out.end(), hand.begin(), hand.end());
    }
    return out;
  }

  // The place that the hand takes hold of: the front, where it hangs free of the body.
  void ChoosePinch() {
    constexpr double kFreeMm = 15;
    const Vector3d goal = kPelvisMm + Vector3d(45, -40, 0);
    const Body body = BodyAt(0);
    double least = std::numeric_limits<double>::infinity();
    const std::vector<Vector3d>& x = solver_->positions_mm();
    for (size_t v = 0; v < x.size(); ++v) {
      if (x[v].z() > 0) continue;
      // Where it is nowhere free, the place that is nearest to the goal.
      const double far = body.DistanceTo(x[v]).distance_mm < kFreeMm ? 1e6 : 0;
      const double d = far + (x[v] - goal).head<2>().squaredNorm();
      if (d < least) least = d, pinched_ = static_cast<int>(v);
    }
    pinch_at_mm_ = x[pinched_];
  }

  // Follows the place on the moving cloth until the hand is there, never so far that fingers press it
  // against the body.
  void AimHand(double from_s, double to_s) {
    const std::optional<PinchState> state = PinchStateAt(to_s);
    if (!state || !state->aims) return;
    constexpr double kClearMm = 18, kFollowMmPerS = 150;
    Vector3d goal = solver_->positions_mm()[pinched_];
    const double clear = BodyAt(to_s).DistanceTo(goal).distance_mm;
    goal += std::max(0.0, kClearMm - clear) * state->hand.away;
    const Vector3d way = goal - pinch_at_mm_;
    const double longest = state->is_away ? way.norm() : kFollowMmPerS * (to_s - from_s);
    pinch_at_mm_ += std::min(1.0, longest / std::max(way.norm(), 1e-9)) * way;
  }

  // Cloth that the fingertips touch when they begin to close moves with them until they open. Where more
  // force would be needed than fingers have, it slips.
  void Pinch(double time_s, StepInput& input) {
    constexpr double kGripN = 6, kSpringMm = 1;  // all fingers; at which a spring gives way
    const std::optional<PinchState> state = PinchStateAt(time_s);
    if (!state) return;
    const std::vector<Vector3d>& x = solver_->positions_mm();
    const std::array<Vector3d, 2> tips = Hand(state->hand).Tips();
    if (state->holds && held_.empty()) {
      constexpr double kTouchMm = 11.5;  // from the middle of a tip
      for (size_t v = 0; v < x.size(); ++v)
        for (int tip = 0; tip < 2; ++tip)
          if ((x[v] - tips[tip]).norm() < std::max(kTouchMm, 0.8 * garment_.cell_mm))
            held_.push_back({static_cast<int>(v), tip, x[v] - tips[tip]});
    }
    if (!state->holds) held_.clear();
    if (held_.empty()) return;
    input.grip_n_per_m = 1e3 * kGripN / kSpringMm / static_cast<double>(held_.size());
    for (Held& h : held_) {
      Vector3d pull = tips[h.tip] + h.from_tip_mm - x[h.vertex];
      if (const double far = pull.norm(); far > kSpringMm) pull *= kSpringMm / far;
      h.from_tip_mm = x[h.vertex] + pull - tips[h.tip];
      input.grips.push_back({h.vertex, x[h.vertex] + pull});
    }
  }

  void HoldWaist(const Body& body, StepInput& input) const {
    for (const int v : waist_) {
      input.held.push_back(v);
      input.held_at_mm.push_back(body.world_from_pelvis() * (start_mm_[v] - kPelvisMm));
    }
  }

  absl::Status Advance(double until_s) {
    const int steps = StepsWithin(until_s - time_s_, step_s_);
    const double h = (until_s - time_s_) / std::max(1, steps);
    Solid before = SolidAt(time_s_);
    for (int k = 0; k < steps; ++k) {
      AimHand(time_s_, time_s_ + h);
      time_s_ += h;
      const Solid solid = SolidAt(time_s_);
      Obstacle obstacle;
      obstacle.distance = [&](const Vector3d& p, double far) { return solid.DistanceWithin(p, far); };
      obstacle.velocity_mm_s = [&](const Vector3d& p) -> Vector3d {
        return (p - solid.PlaceIn(before, p)) / h;
      };
      StepInput input;
      input.obstacle = &obstacle;
      const auto trunk = waist_.empty() ? &Body::world_from_chest : &Body::world_from_pelvis;
      input.carry = (solid.body.*trunk)() * (before.body.*trunk)().inverse();
      const double calm = std::clamp(-time_s_ / DressingS(), 0.0, 1.0);
      input.drag_per_s = 25 * calm * calm;
      if (time_s_ + DressingS() < kGrowS) input.gravity_mm_s2 *= 0.3;
      Pinch(time_s_, input);
      HoldWaist(solid.body, input);
      solver_->Step(h, input);
      before = solid;
    }
    time_s_ = until_s;
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
  int pinched_ = 0;  // vertex
  struct Held {
    int vertex = 0;
    int tip = 0;
    Vector3d from_tip_mm;
  };
  std::vector<Held> held_;
};

absl::StatusOr<Outfit> MakeOutfit(const PerformanceOptions& options) {
  switch (options.garment) {
    case GarmentKind::kSkirt:
      return MakeSkirt(options.cell_mm);
    case GarmentKind::kShirtAndSkirt:
      return MakeShirtAndSkirt(options.cell_mm);
    default:
      return MakeTShirt(options.cell_mm);
  }
}

// Where a worn garment of twice the cell has the vertices of `fine`; empty when that passes through itself.
absl::StatusOr<std::vector<Vector3d>> WornCoarsely(PerformanceOptions options, const SewnPanels& fine,
                                                   const std::function<void(double)>& on_progress) {
  options.cell_mm *= 2;
  options.step_s = 0;
  WEFT_ASSIGN_OR_RETURN(const Outfit outfit, MakeOutfit(options));
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<PerformanceSource> worn, WearGarment(options, on_progress));
  std::vector<Vector3d> out = PositionsOn(outfit.sewn, worn->garment().rest.vertices_mm, fine);
  WEFT_ASSIGN_OR_RETURN(const auto untangled,
                        RemoveSelfIntersections(fine.garment.rest.faces, {}, UntangleOptions(), &out));
  if (untangled.pairs_after > 0) out.clear();
  return out;
}

}  // namespace

double AutomaticStepS(const PerformanceOptions& options) {
  PerformanceOptions automatic = options;
  automatic.step_s = 0;
  return StepOf(automatic, kFastestWorn_mm_per_s);
}

absl::StatusOr<std::unique_ptr<PerformanceSource>> WearGarment(
    const PerformanceOptions& options, const std::function<void(double)>& on_progress) {
  WEFT_ASSIGN_OR_RETURN(Outfit outfit, MakeOutfit(options));
  const auto report = [&](double from, double to) -> std::function<void(double)> {
    if (!on_progress) return {};
    return [=](double share) { on_progress(from + share * (to - from)); };
  };
  std::vector<Vector3d> worn_mm;
  if (options.cell_mm < kFinelyPutOnMm) {
    WEFT_ASSIGN_OR_RETURN(auto coarsely, WornCoarsely(options, outfit.sewn, report(0, 0.5)));
    worn_mm = std::move(coarsely);
  }
  const double done = worn_mm.empty() ? 0 : 0.5;
  auto worn = std::make_unique<WornPerformance>(options, std::move(outfit), std::move(worn_mm));
  WEFT_RETURN_IF_ERROR(worn->Dress(report(done, 1)));
  return worn;
}

absl::StatusOr<std::unique_ptr<PerformanceSource>> ResumeGarment(const PerformanceOptions& options,
                                                                 std::string_view state) {
  WEFT_ASSIGN_OR_RETURN(Outfit outfit, MakeOutfit(options));
  auto worn = std::make_unique<WornPerformance>(options, std::move(outfit));
  WEFT_RETURN_IF_ERROR(worn->Restore(state));
  return worn;
}

std::optional<ClothPrint> PrintOfWorn(const std::vector<Face>& faces, double cell_mm) {
  PerformanceOptions options;
  options.cell_mm = cell_mm;
  for (const GarmentKind kind : {GarmentKind::kTShirt, GarmentKind::kSkirt, GarmentKind::kShirtAndSkirt}) {
    options.garment = kind;
    absl::StatusOr<Outfit> outfit = MakeOutfit(options);
    if (outfit.ok() && outfit->sewn.garment.rest.faces == faces) return outfit->sewn.garment.print;
  }
  return std::nullopt;
}

}  // namespace weft
