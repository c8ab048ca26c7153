#include "alignment/temporal.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "alignment/fill.h"
#include "alignment/placement.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// The cloth's acceleration is alike over so many rings of vertices.
constexpr int kAcceleratedRings = 3;

// Of the way between the neighbours, the share that cloth may be off the straight line; standard deviation.
constexpr double kOffTheLine = 0.15;

// Of the acceleration of hidden cloth as the cloth around tells it, the share that may be wrong.
constexpr double kAccelerationError = 0.5;

// Of how unlike the ways of neighbours are, the share by which a way may be off for each edge to the nearest
// known one; standard deviation. From 0.12 to 0.5 the presets are alike (docs/decoding-accuracy-history.md).
constexpr double kCarryError = 0.25;

absl::Status CheckSize(const AlignmentModel& model, const RegisteredMesh& mesh) {
  const auto vertices = static_cast<size_t>(model.graph().vertices);
  if (mesh.vertices_mm.size() == vertices && mesh.state.size() == vertices &&
      mesh.sigma_mm.size() == vertices && mesh.views.size() == vertices) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat("temporal: a mesh has ", mesh.vertices_mm.size(), " vertices, the template ", vertices));
}

bool Measured(const RegisteredMesh& mesh, size_t v) {
  return mesh.state[v] == VertexState::kObserved || mesh.state[v] == VertexState::kTwoView;
}

Eigen::Vector3d Middle(const RegisteredMesh& previous, const RegisteredMesh& next, size_t v) {
  return 0.5 * (previous.vertices_mm[v] + next.vertices_mm[v]);
}

// Mean over a vertex and its neighbours, of those that `counted` names, as often as asked; others keep 0.
std::vector<Eigen::Vector3d> Smoothed(const MeshGraph& graph, const std::vector<bool>& counted, int rings,
                                      std::vector<Eigen::Vector3d> values) {
  std::vector<Eigen::Vector3d> before;
  for (int ring = 0; ring < rings; ++ring) {
    before = values;
    for (int v = 0; v < graph.vertices; ++v) {
      if (!counted[v]) continue;
      int count = 1;
      for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) {
        const int other = graph.neighbor[i];
        if (!counted[other]) continue;
        values[v] += before[other];
        ++count;
      }
      values[v] /= count;
    }
  }
  return values;
}

// The same without taking width from what is smooth: 2 S - S S of the smoothing S keeps a bend as it is.
std::vector<Eigen::Vector3d> Sharpened(const MeshGraph& graph, const std::vector<bool>& counted, int rings,
                                       std::vector<Eigen::Vector3d> values) {
  const std::vector<Eigen::Vector3d> once = Smoothed(graph, counted, rings, std::move(values));
  std::vector<Eigen::Vector3d> twice = Smoothed(graph, counted, rings, once);
  for (size_t v = 0; v < twice.size(); ++v) twice[v] = 2 * once[v] - twice[v];
  return twice;
}

// Where vertices are that another frame measured and the own one did not: as there, moved with the cloth
// around them that both measured.
struct Carried {
  std::vector<Eigen::Vector3d> position_mm;
  std::vector<double> variance_mm2;  // 0 where nothing is carried
};
absl::StatusOr<Carried> CarryOver(const MeshGraph& graph, const RegisteredMesh& from,
                                  const RegisteredMesh& own) {
  const std::vector<Eigen::Vector3d> none(own.vertices_mm.size(), Eigen::Vector3d::Zero());
  Carried carried{from.vertices_mm, std::vector<double>(own.vertices_mm.size(), 0)};
  std::vector<bool> in_both(own.vertices_mm.size()), known = in_both;
  for (size_t v = 0; v < in_both.size(); ++v) in_both[v] = Measured(from, v) && Measured(own, v);
  std::vector<Eigen::Vector3d> way_mm = none, unlike_mm = none;  // the latter a length, in x
  bool any = false;
  for (int v = 0; v < graph.vertices; ++v) {
    if (in_both[v]) way_mm[v] = own.vertices_mm[v] - from.vertices_mm[v];
  }
  for (int v = 0; v < graph.vertices; ++v) {
    int count = 0;
    for (int i = graph.first[v]; in_both[v] && i < graph.first[v + 1]; ++i) {
      if (!in_both[graph.neighbor[i]]) continue;
      unlike_mm[v].x() += (way_mm[graph.neighbor[i]] - way_mm[v]).norm();
      ++count;
    }
    if (count == 0) continue;
    unlike_mm[v] /= count;
    any = known[v] = true;
  }
  if (!any) return carried;
  for (std::vector<Eigen::Vector3d>* values : {&way_mm, &unlike_mm}) {
    WEFT_RETURN_IF_ERROR(LaplacianFill(graph, known, values));
  }
  const std::vector<int> rings = RingDistance(graph, known);
  for (size_t v = 0; v < known.size(); ++v) {
    if (!Measured(from, v) || Measured(own, v) || rings[v] < 0) continue;
    carried.position_mm[v] += way_mm[v];
    carried.variance_mm2[v] =
        std::pow(from.sigma_mm[v], 2) + std::pow(kCarryError * rings[v] * unlike_mm[v].x(), 2);
  }
  return carried;
}

// How three frames of a vertex differ from even motion, own - middle: what was measured, and what of it is
// the cloth's acceleration.
struct UnevenMotion {
  std::vector<bool> measured;                   // in all three frames
  std::vector<Eigen::Vector3d> seen_mm;         // 0 where not measured
  std::vector<Eigen::Vector3d> accelerated_mm;  // smooth over the surface; from the measured ones elsewhere
};
absl::StatusOr<UnevenMotion> FindUnevenMotion(const MeshGraph& graph, const RegisteredMesh& previous,
                                              const RegisteredMesh& own, const RegisteredMesh& next,
                                              int rings) {
  const size_t vertices = own.vertices_mm.size();
  UnevenMotion motion;
  motion.measured.assign(vertices, false);
  motion.seen_mm.assign(vertices, Eigen::Vector3d::Zero());
  bool any = false;
  for (size_t v = 0; v < vertices; ++v) {
    if (!Measured(previous, v) || !Measured(own, v) || !Measured(next, v)) continue;
    any = motion.measured[v] = true;
    motion.seen_mm[v] = own.vertices_mm[v] - Middle(previous, next, v);
  }
  motion.accelerated_mm = Sharpened(graph, motion.measured, rings, motion.seen_mm);
  if (any) {
    WEFT_RETURN_IF_ERROR(LaplacianFill(graph, motion.measured, &motion.accelerated_mm));
  }
  return motion;
}

// Where measured vertices are by the measurements of three frames: of what is no acceleration, and so noise,
// 2/3 go, then the three weigh the same. The larger a move against sigma, the less it is noise, and the less
// of it is made.
std::vector<Eigen::Vector3d> SharedNoise(const MeshGraph& graph, const RegisteredMesh& own,
                                         const UnevenMotion& motion, double max_sigmas) {
  std::vector<Eigen::Vector3d> position_mm = own.vertices_mm;
  for (int v = 0; v < graph.vertices; ++v) {
    if (!motion.measured[v]) continue;
    const Eigen::Vector3d move = 2.0 / 3 * (motion.accelerated_mm[v] - motion.seen_mm[v]);
    const double limit_mm2 = std::pow(2 * max_sigmas * own.sigma_mm[v], 2);
    if (limit_mm2 > 0) position_mm[v] += move * limit_mm2 / (limit_mm2 + move.squaredNorm());
  }
  return position_mm;
}

Deformation DeformationAt(const AlignmentModel& model, const std::vector<Eigen::Vector3d>& position_mm) {
  const std::vector<Eigen::Vector3d>& rest = model.rest().vertices_mm;
  const Eigen::Isometry3d placement = RigidFit(rest, position_mm);
  Deformation deformation;
  deformation.position_mm = position_mm;
  deformation.rotation.assign(rest.size(), placement.rotation());
  FitRigid(model.slices(), &deformation);
  return deformation;
}

absl::Status Relax(const AlignmentModel& model, const ElasticProblem& problem, const TemporalOptions& options,
                   const CancelCheck& cancelled, std::vector<Eigen::Vector3d>* position_mm) {
  Deformation deformation = DeformationAt(model, *position_mm);
  const absl::StatusOr<ElasticReport> report =
      SolveElastic(model.slices(), model.graph(), problem, options.elastic, &deformation, cancelled);
  if (!report.ok()) return report.status();
  *position_mm = std::move(deformation.position_mm);
  return absl::OkStatus();
}

absl::StatusOr<TemporalResult> Untangled(const AlignmentModel& model, RegisteredMesh mesh,
                                         const TemporalOptions& options) {
  TemporalResult result{std::move(mesh), {}};
  if (!options.remove_self_intersections) return result;
  WEFT_ASSIGN_OR_RETURN(const UntangleReport untangling,
                        RemoveSelfIntersections(model.rest().faces, options.untangle, &result.mesh));
  result.untangling = untangling;
  return result;
}

}  // namespace

absl::Status TemporalOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("temporal.", what));
  };
  if (!(weight > 0) || !std::isfinite(weight)) return bad("weight must be positive");
  if (!(reference_sigma_mm > 0)) return bad("reference_sigma_mm must be positive");
  if (!(max_observed_sigmas >= 0)) return bad("max_observed_sigmas must not be negative");
  return elastic.Validate();
}

absl::StatusOr<TemporalResult> RefineInTime(const AlignmentModel& model, const RegisteredMesh& previous,
                                            const RegisteredMesh& own, const RegisteredMesh& next,
                                            const TemporalOptions& options,
                                            const std::vector<RayTarget>& rays,
                                            const CancelCheck& cancelled) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  for (const RegisteredMesh* mesh : {&previous, &own, &next}) {
    WEFT_RETURN_IF_ERROR(CheckSize(model, *mesh));
  }
  WEFT_RETURN_IF_ERROR(CheckRays(rays, model.graph().vertices));
  const size_t vertices = own.vertices_mm.size();
  WEFT_ASSIGN_OR_RETURN(const UnevenMotion motion,
                        FindUnevenMotion(model.graph(), previous, own, next, kAcceleratedRings));
  std::vector<Carried> carried_over;
  for (const RegisteredMesh* from : {&previous, &next}) {
    if (!options.weigh_by_sigma) continue;  // Eq. 5 knows the mean of both alone
    WEFT_ASSIGN_OR_RETURN(Carried carried, CarryOver(model.graph(), *from, own));
    carried_over.push_back(std::move(carried));
  }
  RegisteredMesh refined = own;
  refined.vertices_mm = SharedNoise(model.graph(), own, motion, options.max_observed_sigmas);
  const std::vector<Eigen::Vector3d> measured_mm = refined.vertices_mm;
  ElasticProblem problem;
  problem.targets_mm = own.vertices_mm;
  problem.weights.assign(vertices, options.weight * Eigen::Matrix3d::Identity());
  problem.frozen.assign(vertices, false);
  for (size_t v = 0; v < vertices; ++v) {
    problem.frozen[v] = Measured(own, v);
    if (problem.frozen[v]) continue;
    const double own_mm2 = std::pow(std::max(own.sigma_mm[v], 1e-3f), 2);
    double pair_mm2 = (std::pow(previous.sigma_mm[v], 2) + std::pow(next.sigma_mm[v], 2)) / 4 +
                      std::pow(kAccelerationError, 2) * motion.accelerated_mm[v].squaredNorm();
    Eigen::Vector3d even = Middle(previous, next, v) + motion.accelerated_mm[v];
    for (const Carried& carried : carried_over) {
      if (carried.variance_mm2[v] == 0 || carried.variance_mm2[v] >= pair_mm2) continue;
      even = carried.position_mm[v];
      pair_mm2 = carried.variance_mm2[v];
    }
    const double own_share = options.weigh_by_sigma ? pair_mm2 / (own_mm2 + pair_mm2) : 0.5;
    problem.targets_mm[v] = own_share * own.vertices_mm[v] + (1 - own_share) * even;  // Eq. 5
    if (!options.weigh_by_sigma) continue;
    // Errors of one vertex in three frames are alike: the better of both counts, not their number.
    const double best_mm2 = std::min(own_mm2, pair_mm2);
    refined.sigma_mm[v] = static_cast<float>(std::sqrt(best_mm2));
    problem.weights[v] *= std::pow(options.reference_sigma_mm, 2) /
                          std::max(best_mm2, 0.01 * std::pow(options.reference_sigma_mm, 2));
  }
  const std::vector<RayTarget> near = RaysInReach(rays, problem.frozen, own.vertices_mm, options.rays);
  AddRays(WithoutOutliers(near, model.graph(), own.vertices_mm, options.rays), own.vertices_mm, options.rays,
          &problem);
  WEFT_RETURN_IF_ERROR(Relax(model, problem, options, cancelled, &refined.vertices_mm));
  // Single precision inside the solver must not move what was measured.
  for (size_t v = 0; v < vertices; ++v) {
    if (problem.frozen[v]) refined.vertices_mm[v] = measured_mm[v];
  }
  return Untangled(model, std::move(refined), options);
}

absl::StatusOr<TemporalResult> BridgeInTime(const AlignmentModel& model, const RegisteredMesh& previous,
                                            const RegisteredMesh& next, const Gap& gap,
                                            const TemporalOptions& options, const CancelCheck& cancelled) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  for (const RegisteredMesh* mesh : {&previous, &next}) {
    WEFT_RETURN_IF_ERROR(CheckSize(model, *mesh));
  }
  if (gap.frames_since_previous < 1 || gap.frames_to_next < 1) {
    return absl::InvalidArgumentError("temporal: a gap has at least one frame on either side");
  }
  const size_t vertices = previous.vertices_mm.size();
  const double share =
      static_cast<double>(gap.frames_since_previous) / (gap.frames_since_previous + gap.frames_to_next);
  RegisteredMesh mesh;
  mesh.state.assign(vertices, VertexState::kBridged);
  mesh.views.assign(vertices, 0);
  for (size_t v = 0; v < vertices; ++v) {
    const Eigen::Vector3d way = next.vertices_mm[v] - previous.vertices_mm[v];
    mesh.vertices_mm.push_back(previous.vertices_mm[v] + share * way);
    mesh.sigma_mm.push_back(static_cast<float>(
        std::hypot(std::max(previous.sigma_mm[v], next.sigma_mm[v]), kOffTheLine * way.norm())));
  }
  ElasticProblem problem{mesh.vertices_mm, {}, {}};
  problem.weights.assign(vertices, options.weight * Eigen::Matrix3d::Identity());
  WEFT_RETURN_IF_ERROR(Relax(model, problem, options, cancelled, &mesh.vertices_mm));
  return Untangled(model, std::move(mesh), options);
}

}  // namespace weft
