#include "alignment/align.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "alignment/cloth_continuation.h"
#include "alignment/fill.h"
#include "alignment/fold_lines.h"
#include "alignment/local_stretch.h"
#include "alignment/outliers.h"
#include "alignment/placement.h"
#include "alignment/return_to_points.h"
#include "alignment/start_mesh.h"
#include "alignment/vertex_sigma.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"

namespace weft {
namespace {

// Relative tolerance of the first solve, whose result only starts the next one.
constexpr double kFirstTolerance = 1e-3;

// Associations of a scan with the mesh.
constexpr int kReconRounds = 4;

// Looks for hidden cloth on the wrong side of another garment.
constexpr int kLayerRounds = 4;

// Solves with rays, each without the outliers of the one before.
constexpr int kRayRounds = 3;

std::vector<Eigen::Matrix3d> VertexWeights(int vertices, const std::vector<VertexTarget>& targets,
                                           const DetectionOptions& options) {
  std::vector<Eigen::Matrix3d> weights(vertices, options.filled_weight * Eigen::Matrix3d::Identity());
  for (const VertexTarget& t : targets) weights[t.vertex] = WeightOf(t, options);
  return weights;
}

// Fill, rigid fit and E_Det + lambda E_Dist, first with all targets, then without the outliers.
class Passes {
 public:
  Passes(const AlignmentModel& model, const AlignOptions& options, const AlignContext& context,
         const Eigen::Isometry3d& placement, std::vector<StageReport>* stages)
      : model_(model), options_(options), context_(context), placement_(placement), stages_(stages) {}

  // Cloth begins stiff and ends as soft as it is.
  absl::Status RunFirst(const std::vector<VertexTarget>& targets) {
    WEFT_ASSIGN_OR_RETURN(ElasticProblem problem, Prepare(targets, ""));
    if (context_.start_mm != nullptr) {
      WEFT_ASSIGN_OR_RETURN(auto moved, MovedWithTargets(model_.graph(), targets, *context_.start_mm));
      problem.targets_mm = std::move(moved);
    }
    deformation_.position_mm = problem.targets_mm;
    deformation_.rotation.assign(deformation_.position_mm.size(), placement_.rotation());
    Watch("fill");
    Fit("");
    ElasticOptions stiff = options_.elastic;
    stiff.distortion.bending = options_.first_bending;
    stiff.tolerance = kFirstTolerance;
    const Stopwatch watch;
    WEFT_ASSIGN_OR_RETURN(const ElasticPreconditioner preconditioner,
                          ElasticPreconditioner::Build(*slices_, model_.graph(), problem, options_.elastic));
    if (options_.first_bending == 0)
      return Solve(problem, preconditioner, options_.elastic, "elastic", watch);
    absl::Status status = Solve(problem, preconditioner, stiff, "stiff", watch);
    return status.ok() ? Solve(problem, preconditioner, options_.elastic, "elastic", Stopwatch()) : status;
  }

  // From here on the cloth is as long as it was measured.
  absl::Status Stretch(const std::vector<VertexTarget>& targets) {
    WEFT_ASSIGN_OR_RETURN(const ElasticProblem problem, Prepare(targets, "_stretched"));
    WEFT_ASSIGN_OR_RETURN(SlicedMesh mesh,
                          StretchToTargets(model_, targets, deformation_.rotation, options_.stretch_rings));
    stretched_ = std::move(mesh);
    slices_ = &stretched_;
    return Solve(problem, options_.elastic, "elastic_stretched");
  }

  // From where the last pass ended; what it set aside starts anew from its neighbours.
  absl::Status RunAgain(const std::vector<VertexTarget>& all, const std::vector<VertexTarget>& kept,
                        int round) {
    const MeshGraph& graph = model_.graph();
    std::vector<bool> settled(graph.vertices, true);
    for (const VertexTarget& t : all) settled[t.vertex] = false;
    for (const VertexTarget& t : kept) settled[t.vertex] = true;
    const std::string suffix = absl::StrCat("_without_outliers_", round);
    WEFT_ASSIGN_OR_RETURN(const ElasticProblem problem, Prepare(kept, suffix));
    WEFT_RETURN_IF_ERROR(LaplacianFill(graph, settled, &deformation_.position_mm));
    const std::vector<Eigen::Matrix3d> rotation = deformation_.rotation;
    Fit(suffix);
    for (int v = 0; v < graph.vertices; ++v) {
      bool keep = settled[v];
      for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) keep = keep && settled[graph.neighbor[i]];
      if (keep) deformation_.rotation[v] = rotation[v];
    }
    return Solve(problem, options_.elastic, "elastic" + suffix);
  }

  // Vertices that `targets` does not hold go to the rays that are near them.
  absl::Status RunRays(const std::vector<VertexTarget>& targets) {
    if (context_.rays == nullptr) return absl::OkStatus();
    const RayFit fit = RayFitOf(options_);
    std::vector<bool> measured = HiddenBy(targets);
    measured.flip();
    rays_ = RaysInReach(*context_.rays, measured, deformation_.position_mm, fit);
    for (int round = 1; round <= kRayRounds && !rays_.empty(); ++round) {
      WEFT_RETURN_IF_ERROR(Solve(HeldByTargets(targets), options_.elastic, absl::StrCat("rays_", round)));
      std::vector<RayTarget> kept = WithoutOutliers(rays_, model_.graph(), deformation_.position_mm, fit);
      if (kept.size() == rays_.size() || round == kRayRounds) break;
      rays_ = std::move(kept);
    }
    return absl::OkStatus();
  }

  // E_Push and E_Recon for what `targets` does not hold, from where the last pass ended.
  absl::Status RunHidden(const std::vector<VertexTarget>& targets) {
    const bool scanned = context_.scan != nullptr && options_.recon.weight > 0;
    if (!scanned && options_.push.weight == 0) return absl::OkStatus();
    ElasticProblem base = HeldByTargets(targets);
    const std::vector<bool> hidden = HiddenBy(targets);
    if (scanned) {
      WEFT_RETURN_IF_ERROR(LookAtScan());
    }
    if (options_.push.weight > 0) {
      AddPush(deformation_.position_mm, model_.rest().faces, hidden, options_.push, &base);
    }
    for (int round = 1; round <= (scanned ? kReconRounds : 1); ++round) {
      ElasticProblem problem = base;
      if (scanned) {
        scan_.vertices = AddRecon(scan_.is_turned ? turned_ : *context_.scan, deformation_.position_mm,
                                  model_.rest().faces, hidden, options_.recon, &problem);
      }
      WEFT_RETURN_IF_ERROR(
          Solve(problem, options_.elastic, scanned ? absl::StrCat("recon_", round) : "push"));
    }
    return absl::OkStatus();
  }

  // Hidden cloth of several garments goes to the side where it belongs.
  absl::Status RunLayers(const std::vector<VertexTarget>& targets) {
    if (model_.garments().size() < 2 || options_.layers.weight == 0) return absl::OkStatus();
    const ElasticProblem base = HeldByTargets(targets);
    const std::vector<bool> hidden = HiddenBy(targets);
    for (int round = 1; round <= kLayerRounds; ++round) {
      WEFT_ASSIGN_OR_RETURN(const auto layers, GarmentLayers::Build(model_.garments(), model_.rest().faces,
                                                                    deformation_.position_mm));
      if (round == 1) layers_ = layers.Order(hidden, options_.layers);
      ElasticProblem problem = base;
      if (layers.Draw(layers_, hidden, options_.layers, &problem) == 0) break;
      WEFT_RETURN_IF_ERROR(Solve(problem, options_.elastic, absl::StrCat("layers_", round)));
    }
    return absl::OkStatus();
  }

  const Deformation& deformation() const { return deformation_; }
  const std::vector<GarmentPair>& layers() const { return layers_; }
  int rays() const { return static_cast<int>(rays_.size()); }
  const ScanUse& scan() const { return scan_; }

 private:
  // E_Det (Eq. 1), the vertices without a target drawn to where the fill has them.
  absl::StatusOr<ElasticProblem> Prepare(const std::vector<VertexTarget>& targets,
                                         const std::string& suffix) {
    const Stopwatch watch;
    std::vector<Eigen::Vector3d> placed_mm;
    for (const Eigen::Vector3d& v : model_.rest().vertices_mm) placed_mm.push_back(placement_ * v);
    FillStart filled = PrepareFill(model_.graph(), targets, std::move(placed_mm));
    WEFT_RETURN_IF_ERROR(LaplacianFill(model_.graph(), filled.known, &filled.position_mm));
    ElasticProblem problem{std::move(filled.position_mm),
                           VertexWeights(model_.graph().vertices, targets, options_.detection),
                           {}};
    continued_ = ContinueCloth(model_, targets, options_.continuation, options_.detection.reference_sigma_mm);
    DrawToContinued(&problem);
    Report("fill" + suffix, {}, watch);
    return problem;
  }

  // E_Det where the last pass ended: what was not measured stays there, as weakly as it is filled.
  ElasticProblem HeldByTargets(const std::vector<VertexTarget>& targets) const {
    const int vertices = model_.graph().vertices;
    ElasticProblem problem{deformation_.position_mm, VertexWeights(vertices, targets, options_.detection),
                           std::vector<bool>(vertices, false)};
    for (const VertexTarget& t : targets) {
      problem.targets_mm[t.vertex] = t.position_mm;
      problem.frozen[t.vertex] = options_.freeze_observed && t.views != 2;
    }
    DrawToContinued(&problem);
    AddRays(rays_, deformation_.position_mm, RayFitOf(options_), &problem);
    return problem;
  }

  // Whether the scan lies on the cloth, and which way its normals point.
  absl::Status LookAtScan() {
    const AssociationOptions& association = options_.recon.association;
    const std::vector<Eigen::Vector3d>& cloth_mm = deformation_.position_mm;
    const ScanFit fit = FitOfScan(*context_.scan, cloth_mm, model_.rest().faces, association);
    scan_ = {.found = fit.is_turned ? fit.inward : fit.outward,
             .median_distance_mm = fit.median_distance_mm,
             .is_turned = fit.is_turned};
    if (fit.is_turned) {
      turned_ = *context_.scan;
      for (Eigen::Vector3d& normal : turned_.normals) normal = -normal;
    }
    return CheckScanUnit(*context_.scan, fit, cloth_mm, model_.rest().faces, association);
  }

  std::vector<bool> HiddenBy(const std::vector<VertexTarget>& targets) const {
    std::vector<bool> hidden(model_.graph().vertices, true);
    for (const VertexTarget& t : targets) hidden[t.vertex] = false;
    return hidden;
  }

  void DrawToContinued(ElasticProblem* problem) const {
    for (const ContinuedVertex& v : continued_) {
      problem->targets_mm[v.vertex] = v.position_mm;
      const double weight = std::pow(options_.detection.reference_sigma_mm / v.sigma_mm, 2);
      problem->weights[v.vertex] = weight * Eigen::Matrix3d::Identity();
    }
  }

  void Fit(const std::string& suffix) {
    const Stopwatch watch;
    FitRigid(*slices_, &deformation_);
    Report("rigid_fit" + suffix, {}, watch);
  }

  absl::Status Solve(const ElasticProblem& problem, const ElasticOptions& options, const std::string& name) {
    const Stopwatch watch;
    WEFT_ASSIGN_OR_RETURN(const ElasticPreconditioner preconditioner,
                          ElasticPreconditioner::Build(*slices_, model_.graph(), problem, options));
    return Solve(problem, preconditioner, options, name, watch);
  }
  absl::Status Solve(const ElasticProblem& problem, const ElasticPreconditioner& preconditioner,
                     const ElasticOptions& options, const std::string& name, const Stopwatch& watch) {
    WEFT_ASSIGN_OR_RETURN(const ElasticReport report, SolveElastic(*slices_, problem, preconditioner, options,
                                                                   &deformation_, context_.cancelled));
    Report(name, report, watch);
    Watch(name);
    return absl::OkStatus();
  }

  void Watch(const std::string& name) const {
    if (context_.watch) context_.watch(name, deformation_.position_mm);
  }

  void Report(const std::string& name, const ElasticReport& report, const Stopwatch& watch) {
    stages_->push_back({name, report.iterations, report.energy_before, report.energy_after, watch.Ms()});
  }

  const AlignmentModel& model_;
  const AlignOptions& options_;
  const AlignContext& context_;
  const Eigen::Isometry3d placement_;
  std::vector<StageReport>* stages_;
  std::vector<ContinuedVertex> continued_;
  std::vector<RayTarget> rays_;  // that the mesh follows
  ScanUse scan_;
  Scan turned_;  // the scan with normals that point outwards, where its own do not
  std::vector<GarmentPair> layers_;
  SlicedMesh stretched_;
  const SlicedMesh* slices_ = &model_.slices();
  Deformation deformation_;
};

// Sigmas know by how much the cloth alone, `elastic_mm`, contradicts the points.
RegisteredMesh Describe(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                        const std::vector<Eigen::Vector3d>& elastic_mm, const AlignOptions& options) {
  RegisteredMesh mesh;
  mesh.vertices_mm = elastic_mm;
  mesh.state.assign(mesh.vertices_mm.size(), VertexState::kInferred);
  mesh.views.assign(mesh.vertices_mm.size(), 0);
  for (const VertexTarget& t : targets) {
    mesh.state[t.vertex] = t.views == 2 ? VertexState::kTwoView : VertexState::kObserved;
    mesh.views[t.vertex] = t.views;
  }
  mesh.sigma_mm = VertexSigmas(model, targets, elastic_mm, options);
  RestoreFolds(model, targets, options, &mesh.vertices_mm);
  ReturnToPoints(targets, options, &mesh.vertices_mm);
  return mesh;
}

}  // namespace

AlignmentModel::AlignmentModel(const Template& garment)
    : rest_(garment.rest),
      graph_(BuildMeshGraph(garment.rest)),
      slices_(SliceMesh(garment.rest, graph_)),
      garments_(garment.garments),
      mean_edge_mm_(MeanEdgeMm(garment.rest, graph_)) {}

absl::StatusOr<AlignResult> Align(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                                  const AlignOptions& options, const AlignContext& context) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_RETURN_IF_ERROR(CheckTargets(targets, model.graph().vertices));
  if (context.start_mm != nullptr) {
    WEFT_RETURN_IF_ERROR(CheckStart(*context.start_mm, model.graph().vertices));
  }
  if (context.rays != nullptr) {
    WEFT_RETURN_IF_ERROR(CheckRays(*context.rays, model.graph().vertices));
  }
  AlignResult result;
  const Stopwatch watch;
  WEFT_ASSIGN_OR_RETURN(const Eigen::Isometry3d placement,
                        PlaceTemplate(model, targets, options.min_target_share));
  result.cloth_scale = ClothScale(model, targets);
  AlignContext placed = context;
  absl::StatusOr<PlacedStart> start;
  if (context.start_mm != nullptr) {
    start = PlaceStart(*context.start_mm, targets);
    if (!start.ok()) return start.status();
    result.start_turned_deg = start->turned_deg;
    placed.start_mm = &start->vertices_mm;
  }
  result.stages.push_back({.name = "place", .time_ms = watch.Ms()});

  Passes passes(model, options, placed, placement, &result.stages);
  WEFT_RETURN_IF_ERROR(passes.RunFirst(targets));
  if (options.stretch_rings > 0) {
    WEFT_RETURN_IF_ERROR(passes.Stretch(targets));
  }
  std::vector<VertexTarget> used = targets;
  for (int round = 1; round <= options.robust.max_rounds; ++round) {
    // Among all targets: good ones that an outlier had dragged along come back.
    const std::vector<double> ratios =
        OutlierRatios(model.graph(), targets, passes.deformation().position_mm, options);
    if (AreAllBut(targets, ratios, used)) break;
    used = WithoutOutliers(targets, ratios, options.detection);
    WEFT_RETURN_IF_ERROR(passes.RunAgain(targets, used, round));
  }
  WEFT_RETURN_IF_ERROR(passes.RunRays(used));
  WEFT_RETURN_IF_ERROR(passes.RunHidden(used));
  WEFT_RETURN_IF_ERROR(passes.RunLayers(used));
  result.layers = passes.layers();
  result.rays = passes.rays();
  result.scan = passes.scan();
  result.outliers = static_cast<int>(targets.size() - used.size());
  result.mesh = Describe(model, used, passes.deformation().position_mm, options);
  if (!options.remove_self_intersections) return result;
  const Stopwatch untangle_watch;
  WEFT_ASSIGN_OR_RETURN(const UntangleReport untangling,
                        RemoveSelfIntersections(model.rest().faces, options.untangle, &result.mesh));
  result.untangling = untangling;
  result.stages.push_back({.name = "untangle",
                           .iterations = untangling.pushes + untangling.returns,
                           .time_ms = untangle_watch.Ms()});
  if (context.watch) context.watch("untangle", result.mesh.vertices_mm);
  return result;
}

absl::StatusOr<AlignResult> Align(const Template& garment, const std::vector<VertexTarget>& targets,
                                  const AlignOptions& options, const AlignContext& context) {
  return Align(AlignmentModel(garment), targets, options, context);
}

}  // namespace weft
