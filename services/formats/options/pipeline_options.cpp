#include "services/formats/options/pipeline_options.h"

#include "base/status_macros.h"
#include "services/formats/options/option_io.h"
#include "services/formats/options/option_range.h"

namespace weft {
namespace {

// Each struct's fields by their names in options.proto. Written and read by the same lines.

void Bind(OptionIo io, GrowthOptions& o) {
  io("iterations", o.fit.iterations);
  io("min_explained", o.fit.min_explained);
  io("min_ink_lead", o.fit.min_ink_lead);
  io("max_move_cells", o.fit.max_move_cells);
  io("min_edge_px", o.fit.min_edge_px);
  io("min_area_px", o.fit.min_area_px);
  io("clearly_explained", o.clearly_explained);
  io("min_known_at_boundary", o.min_known_at_boundary);
}

void Bind(OptionIo io, PatchDecodeOptions& o) {
  io("min_evidence", o.min_evidence);
  io("min_margin", o.min_margin);
  io("max_contradicted", o.max_contradicted);
  io("min_evidence_contradicted", o.min_evidence_contradicted);
}

void Bind(OptionIo io, ConfidenceOptions& o) {
  io("min_to_grow", o.min_to_grow);
  io("min_at_boundary", o.min_at_boundary);
  io("min_to_help", o.min_to_help);
  io("min_to_stay", o.min_to_stay);
  io("min_component", o.min_component);
}

void Bind(OptionIo io, DecodeOptions& o) {
  io("levels", o.levels);
  io("corners", o.corners);
  io.At("keypoints")("min_contrast", o.keypoints.min_contrast);
  io.At("lattice")("max_stretch", o.lattice.max_stretch);
  io.At("lattice")("min_ink_contrast", o.lattice.min_ink_contrast);
  Bind(io.At("patches"), o.patches);
  Bind(io.At("growth"), o.growth);
  io.At("isolated")("reach_cells", o.isolated.reach_cells);
  io.At("isolated")("min_evidence", o.isolated.min_evidence);
  Bind(io.At("confidence"), o.confidence);
}

void Bind(OptionIo io, ConsensusOptions& o) {
  io("inlier_radius_mm", o.inlier_radius_mm);
  io("max_residual_sigmas", o.max_residual_sigmas);
  io("min_residual_px", o.min_residual_px);
  io("min_views", o.min_views);
  io("min_pair_angle_deg", o.min_pair_angle_deg);
  io("seed", o.seed);
}

void Bind(OptionIo io, RefinementOptions& o) {
  io("huber_sigmas", o.huber_sigmas);
  io("min_sigma_px", o.min_sigma_px);
  io("calibration_sigma_px", o.calibration_sigma_px);
  io("min_angle_deg", o.min_angle_deg);
  io("max_sigma_mm", o.max_sigma_mm);
}

void Bind(OptionIo io, TwoViewOptions& o) {
  io("accept", o.accept);
  io("min_angle_deg", o.min_angle_deg);
  io("max_residual_sigmas", o.max_residual_sigmas);
  io("max_sigma_mm", o.max_sigma_mm);
}

void Bind(OptionIo io, CleaningOptions& o) {
  io("min_neighbors", o.min_neighbors);
  io("min_near_share", o.min_near_share);
  io("max_edge_ratio", o.max_edge_ratio);
  io("min_component", o.min_component);
  io("min_witnesses", o.min_witnesses);
  io("max_strain", o.max_strain);
}

void Bind(OptionIo io, CloudOptions& o) {
  Bind(io.At("consensus"), o.triangulation.consensus);
  Bind(io.At("refinement"), o.triangulation.refinement);
  Bind(io.At("two_view"), o.triangulation.two_view);
  Bind(io.At("cleaning"), o.cleaning);
  io.At("footprint")("neighbor_share", o.footprint.neighbor_share);
  io.At("footprint")("fold_error", o.footprint.fold_error);
  io.At("footprint")("shared_edges", o.footprint.shared_edges);
}

void Bind(OptionIo io, SecondPassOptions& o) {
  io("enabled", o.enabled);
  io("enough_views", o.enough_views);
  io("max_facing_deg", o.prediction.max_facing_deg);
  io("min_explained", o.guided.min_explained);
  io("min_lead", o.guided.min_lead);
  io("min_explained_vague", o.guided.min_explained_vague);
  io("min_lead_vague", o.guided.min_lead_vague);
  io("max_move_sigmas", o.guided.max_move_sigmas);
  io("max_move_cells", o.guided.max_move_cells);
  io("max_sigma_cells", o.guided.max_sigma_cells);
}

void Bind(OptionIo io, DetectionOptions& o) {
  io("weigh_by_sigma", o.weigh_by_sigma);
  io("reference_sigma_mm", o.reference_sigma_mm);
  io("min_sigma_mm", o.min_sigma_mm);
  io("cloth_sigma_mm", o.cloth_sigma_mm);
  io("filled_weight", o.filled_weight);
}

void Bind(OptionIo io, ElasticOptions& o) {
  io("lambda", o.lambda);
  io("stretch", o.distortion.stretch);
  io("bending", o.distortion.bending);
  io("tolerance", o.tolerance);
  io("max_iterations", o.max_iterations);
}

void Bind(OptionIo io, RobustOptions& o) {
  io("max_rounds", o.max_rounds);
  io("outlier_ratio", o.outlier_ratio);
  io("min_distance_mm", o.min_distance_mm);
}

void Bind(OptionIo io, ReconOptions& o) {
  io("weight", o.weight);
  io("tangential_share", o.tangential_share);
  io("max_distance_mm", o.association.max_distance_mm);
  io("max_normal_angle_deg", o.association.max_normal_angle_deg);
}

void Bind(OptionIo io, UntangleOptions& o) {
  io("max_observed_sigmas", o.max_observed_sigmas);
  io("max_pushes", o.max_pushes);
  io("max_rounds", o.max_rounds);
  io("gap_mm", o.back.gap_mm);
}

void Bind(OptionIo io, LayerOptions& o) {
  io("weight", o.weight);
  io("find_order", o.find_order);
  io("reach_mm", o.reach_mm);
}

void Bind(OptionIo io, AlignOptions& o) {
  io("min_target_share", o.min_target_share);
  Bind(io.At("detection"), o.detection);
  Bind(io.At("elastic"), o.elastic);
  io("first_bending", o.first_bending);
  io("stretch_rings", o.stretch_rings);
  io("continuation_rings", o.continuation.rings);
  Bind(io.At("robust"), o.robust);
  io("noise_sigmas", o.noise_sigmas);
  io("freeze_observed", o.freeze_observed);
  io.At("push")("weight", o.push.weight);
  io.At("push")("depth_mm", o.push.depth_mm);
  Bind(io.At("recon"), o.recon);
  io("remove_self_intersections", o.remove_self_intersections);
  Bind(io.At("untangle"), o.untangle);
  Bind(io.At("layers"), o.layers);
  io("ray_reach_mm", o.ray_reach_mm);
}

void Bind(OptionIo io, TemporalOptions& o) {
  io("weight", o.weight);
  io("reference_sigma_mm", o.reference_sigma_mm);
  io("weigh_by_sigma", o.weigh_by_sigma);
  io("max_observed_sigmas", o.max_observed_sigmas);
}

void Bind(OptionIo io, TemplateBuildOptions& o) {
  io("openings", o.openings);
  io("max_hole_mm", o.max_hole_mm);
  io("corners", o.corners);
  io("max_clouds", o.max_clouds);
  io("allow_open_seams", o.allow_open_seams);
  io.At("panels")("min_panel_cells", o.panels.min_panel_cells);
  io.At("panels")("max_hole_mm2", o.panels.max_hole_mm2);
  io.At("panels")("closing_cells", o.panels.closing_cells);
  io.At("panels")("cut_pitches", o.panels.cut_pitches);
  io.At("seams")("max_gap_mm", o.seams.max_gap_mm);
  io.At("seams")("min_points", o.seams.min_points);
  io.At("seams")("max_easing", o.seams.max_easing);
}

void Bind(OptionIo io, PipelineOptions& o) {
  Bind(io.At("decode"), o.decode);
  Bind(io.At("triangulation"), o.cloud);
  Bind(io.At("second_pass"), o.second_pass);
  Bind(io.At("alignment"), o.alignment);
  Bind(io.At("temporal"), o.temporal);
  Bind(io.At("template_build"), o.template_build);
}

}  // namespace

absl::Status CloudOptions::Validate() const {
  absl::Status status = triangulation.Validate();
  status.Update(cleaning.Validate());
  status.Update(footprint.Validate());
  return status;
}

absl::Status SecondPassOptions::Validate() const {
  absl::Status status = prediction.Validate();
  status.Update(guided.Validate());
  return status;
}

absl::Status PipelineOptions::Validate() const {
  absl::Status status = decode.Validate();
  status.Update(cloud.Validate());
  status.Update(second_pass.Validate());
  status.Update(alignment.Validate());
  status.Update(temporal.Validate());
  status.Update(template_build.Validate());
  return status;
}

absl::StatusOr<PipelineOptions> ReadOptions(const v1::PipelineOptions& message) {
  WEFT_RETURN_IF_ERROR(CheckRanges(message));
  PipelineOptions options;
  Bind(OptionIo::Reading(message), options);
  options.temporal.elastic = options.alignment.elastic;
  options.temporal.untangle = options.alignment.untangle;
  options.temporal.rays = RayFitOf(options.alignment);
  options.temporal.remove_self_intersections = options.alignment.remove_self_intersections;
  WEFT_RETURN_IF_ERROR(options.Validate());
  return options;
}

v1::PipelineOptions MessageOf(const PipelineOptions& options) {
  v1::PipelineOptions message;
  PipelineOptions values = options;
  Bind(OptionIo::Writing(message), values);
  return message;
}

}  // namespace weft
