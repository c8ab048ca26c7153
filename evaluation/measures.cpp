#include "evaluation/measures.h"

#include <algorithm>
#include <cstdlib>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr auto kLower = BetterValue::kLower, kHigher = BetterValue::kHigher, kNeither = BetterValue::kNeither;

// Of frames in the order of the columns of frames.csv, then of driven meshes, then of two results. Those of
// errors are means over vertices, cells or observations unless the definition says otherwise. A mesh that is
// too smooth has less jitter as well, so jitter has no better side.
constexpr Measure kMeasures[] = {
    {"coverage", "%", 1, kHigher, "Coverage, 3 cameras or more", "coverage",
     "vertices that three cameras or more measured, of those with a cell"},
    {"two_view_share", "%", 1, kNeither, "Measured by 2 cameras only", "by 2",
     "vertices that two cameras measured, of those with a cell"},
    {"decode_precision", "%", 2, kHigher, "Decoding, precision", "precision",
     "observed cells that are right, within half a cell"},
    {"decode_recall", "%", 2, kHigher, "Decoding, recall", "recall", "scoreable cells that were observed"},
    {"decode_median_px", "px", 3, kLower, "Decoding, error of centres, median", "decoding",
     "distance of right observations from the true pixel, median"},
    {"cloud_coverage", "%", 2, kHigher, "Cloud, vertices with a point", "covered",
     "vertices that 3 cameras or more see well with a point within 1 mm"},
    {"cloud_median_mm", "mm", 3, kLower, "Cloud, error, median", "cloud",
     "distance of points from the true place of their cell, median"},
    {"mesh_visible_mean_mm", "mm", 3, kLower, "Vertex error, seen by 3 or more", "seen by 3+",
     "distance from the truth of vertices that 3 cameras or more see well"},
    {"mesh_hidden_mean_mm", "mm", 3, kLower, "Vertex error, seen by fewer", "by fewer",
     "distance from the truth of all other vertices"},
    {"texture_drift_mm_s", "mm/s", 2, kLower, "Drift by texture flow", "texture drift",
     "optical flow to the next frame between unwrapped textures, times the frame rate"},
    {"texture_flow_lost", "%", 1, kLower, "Texture flow, windows lost", "flow lost",
     "windows whose flow did not come back to its start"},
    {"true_drift_observed_mm_s", "mm/s", 2, kLower, "Exact drift, observed", "exact drift",
     "change to the next frame of the tangential offset from the true surface, times the frame rate; of "
     "vertices that "
     "two cameras or more measured"},
    {"true_drift_inferred_mm_s", "mm/s", 2, kLower, "Exact drift, inferred", "exact, inferred",
     "the same of all other vertices"},
    {"geodesic_distortion_mm", "mm", 2, kLower, "Geodesic distortion", "distortion",
     "change of the geodesic distances from seeded sources against the template"},
    {"geodesic_distortion_relative", "%", 2, kLower, "Geodesic distortion, of the distance", "distortion",
     "the same, of the distance"},
    {"self_intersecting_pairs", "", 1, kLower, "Self-intersections, pairs of faces", "self-intersections",
     "pairs of faces that intersect and share no vertex; over several frames their sum"},
    {"jitter_observed_mm", "mm", 3, kNeither, "Jitter, observed", "jitter",
     "second difference of the position over three frames, of vertices that two cameras or more measured"},
    {"jitter_inferred_mm", "mm", 3, kNeither, "Jitter, inferred", "inferred",
     "the same of all other vertices"},
    {"jitter_of_truth_mm", "mm", 3, BetterValue::kReference, "Jitter of the truth", "of the truth",
     "the same of the true vertices: the cloth's own acceleration"},
    {"error_jitter_observed_mm", "mm", 3, kLower, "Jitter of the error, observed", "error jitter",
     "second difference of the error over three frames, which has no part of the cloth's own acceleration; "
     "of vertices "
     "that two cameras or more measured"},
    {"error_jitter_inferred_mm", "mm", 3, kLower, "Jitter of the error, inferred", "inferred",
     "the same of all other vertices"},
    {"reprojection_px", "px", 3, kLower, "Reprojection error", "reprojection",
     "distance of observations from the projected point"},
    {"left_out_px", "px", 3, kLower, "Left-out camera error", "left out",
     "distance of observations from the point triangulated by all other cameras"},
    {"texture_drift_mm", "mm a frame", 3, kLower, "Drift by texture flow", "texture drift",
     "as texture_drift_mm_s, from one frame to the next"},
    {"true_drift_observed_mm", "mm a frame", 3, kLower, "Exact drift, observed", "exact drift",
     "as true_drift_observed_mm_s, from one frame to the next"},
    {"true_drift_inferred_mm", "mm a frame", 3, kLower, "Exact drift, inferred", "exact, inferred",
     "as true_drift_inferred_mm_s, from one frame to the next"},
    {"error_change_mm", "mm a frame", 3, kLower, "Error, frame to frame, seen by 3 or more", "error change",
     "change of the error to the next frame, of vertices that 3 cameras or more see well"},
    {"error_change_mm_s", "mm/s", 2, kLower, "Error, frame to frame, seen by 3 or more", "error change",
     "the same, times the frame rate"},

    {"mean_mm", "mm", 3, kLower, "Vertex error", "mean", "distance of all vertices from the truth"},
    {"median_mm", "mm", 3, kLower, "Vertex error, median", "median", "the same, median"},
    {"p95_mm", "mm", 3, kLower, "Vertex error at 95 %", "95 %", "the same, 95th percentile"},
    {"across_mm", "mm", 3, kLower, "Vertex error across the rays", "across",
     "distance from the truth across the rays that saw the vertex"},
    {"seen_mm", "mm", 3, kLower, "Vertex error, seen", "seen", "of vertices that a camera saw"},
    {"crossed_mm", "mm", 3, kLower, "Vertex error, seen by 2 or more", "crossed",
     "of vertices that two cameras or more saw"},
    {"unseen_mm", "mm", 3, kLower, "Vertex error, not seen", "unseen", "of vertices that no camera saw"},
    {"unseen_share", "%", 1, kNeither, "Not seen", "unseen %", "vertices that no camera saw"},
    {"chamfer_mm", "mm", 3, kLower, "Chamfer distance", "chamfer",
     "distance between the two sets of vertices"},
    {"error_jitter_seen_mm", "mm", 3, kLower, "Jitter of the error, seen", "jitter",
     "second difference of the error over three frames, of vertices that a camera saw in the middle one"},
    {"error_jitter_unseen_mm", "mm", 3, kLower, "Jitter of the error, not seen", "unseen",
     "the same of all other vertices"},
    {"error_jitter_mm", "mm", 3, BetterValue::kReference, "Jitter of the difference", "jitter",
     "second difference over three frames of what lies between two runs"},
    {"share_within_sigma", "%", 1, kNeither, "Errors below 1 sigma", "1 s %",
     "vertices whose error is below their sigma; 68 % where sigma is right"},
    {"share_within_two_sigma", "%", 1, kNeither, "Errors below 2 sigma", "2 s %",
     "vertices whose error is below two sigma; 95 % where sigma is right"},
    {"lost_frames", "", 0, kLower, "Frames lost", "lost", "frames without a mesh"},
    {"lost_vertices", "", 0, kLower, "Vertices lost", "lost v.",
     "vertices more than 80 mm off, of all frames"},
    {"ms_a_frame", "ms", 1, kLower, "Time a frame", "ms", "without decoding, median over the frames"},
    {"from_registered_mm", "mm", 3, kLower, "Distance from the registration", "from r.",
     "of vertices that the registration has a point of"},
    {"at_seams_mm", "mm", 3, kLower, "Vertex error at seams", "at seams",
     "of vertices within two texels of a seam"},
    {"off_seams_mm", "mm", 3, kLower, "Vertex error off seams", "off seams", "of all other vertices"},
    {"cells_a_view", "", 0, kHigher, "Cells seen in a view", "cells", "cells that were seen in a view"},

    {"distance_mm", "mm", 3, kNeither, "Distance of the meshes' vertices", "distance",
     "distance of each vertex of one result from the same of the other"},
    {"beyond_sigmas_share", "%", 1, kNeither, "Farther apart than sigma explains", "beyond",
     "vertices farther apart than the sigmas of both explain in 99 % of cases"},
};

}  // namespace

std::span<const Measure> Measures() { return kMeasures; }

const Measure& MeasureNamed(std::string_view name) {
  const auto found =
      std::ranges::find(kMeasures, name, [](const Measure& m) { return std::string_view(m.name); });
  if (found == std::end(kMeasures)) std::abort();
  return *found;
}

std::string TitleWithUnit(const Measure& measure, bool narrow) {
  const char* title = narrow ? measure.heading : measure.title;
  return *measure.unit == '\0' ? title : absl::StrCat(title, ", ", measure.unit);
}

double InShownUnit(const Measure& measure, double value) {
  return std::string_view(measure.unit) == "%" ? 100 * value : value;
}

}  // namespace weft
