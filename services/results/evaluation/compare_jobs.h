// Two results of the same frames, measured side by side: presets, rigs before and after refinement, options.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "evaluation/paired_test.h"
#include "services/results/evaluation/evaluate_job.h"
#include "services/results/evaluation/evaluation_measures.h"

namespace weft {

// A difference is significant where it is chance with a smaller probability than this, over all measures.
inline constexpr double kSignificanceLevel = 0.05;

struct ComparisonRequest {
  // Of A; truth, dump, frame rate and options of the measures are those of B as well.
  EvaluationRequest a;
  std::string against;  // folder of the results of B
  // Empty paths are taken from <against>/job.json.
  std::string against_rig, against_garment;

  absl::Status Validate() const;
};

// Numbers of v1::ComparisonOutcome.
enum class ComparisonOutcome { kNotTested = 1, kNoDifference, kABetter, kBBetter, kALower, kAHigher };

// One measure over the frames in which both results have it.
struct ComparedMeasure {
  const EvaluationMeasure* measure = nullptr;
  size_t frames = 0;
  double a = 0, b = 0;             // means over these frames
  std::optional<PairedTest> test;  // of A minus B; empty with fewer than four frames
  double p_adjusted = 1;           // allows for all measures tested (Holm 1979)
  ComparisonOutcome outcome = ComparisonOutcome::kNotTested;
};

// How far the meshes of a frame are apart; empty where one is missing or vertices have no counterpart.
struct FrameDifference {
  std::optional<ErrorSummary> distance_mm;
  std::optional<double> beyond_sigmas_share;  // of the vertices, see evaluation/mesh_difference.h
};

// Means over the frames in which both results have the value, [vertices of A]; NaN where there is none, empty
// where it was not measured at all.
struct DifferenceMaps {
  std::vector<double> distance_mm, distance_sigmas;
  // A minus B; drift in mm/s, or mm a frame where the frame rate is not known.
  VertexMaps a_minus_b;
};

// An input or option of the jobs that is not the same.
struct JobDifference {
  std::string what;  // "triangulation.consensus.inlier_radius_mm"
  std::string a, b;
};

struct JobComparison {
  JobEvaluation a, b;  // of the frames that both have
  std::vector<ComparedMeasure> measures;
  std::vector<FrameDifference> frames;  // in the order of a.frames
  FrameDifference total;                // as in JobEvaluation::total_metrics; the share is a mean
  DifferenceMaps maps;
  std::vector<JobDifference> differences;
  std::vector<EvaluationRemark> remarks;  // about the comparison; those of A and B are theirs
};

// Compares the frames that both results have, several at a time in the calling thread's TBB arena; the same
// numbers at any thread count. Measures are paired by frame and tested (evaluation/paired_test.h). Vertices
// of other templates are compared by board cell; without a board those of meshes with the same faces.
// `on_frame` (may be empty): frames done and all, from any thread, calls never overlap. InvalidArgument: the
// request, results without a common frame. Errors of EvaluateJob.
absl::StatusOr<JobComparison> CompareJobs(const ComparisonRequest& request,
                                          const std::function<void(size_t, size_t)>& on_frame = {});

// Pairs, tests and grades every measure that both evaluations have; `a` and `b` have the same frames.
std::vector<ComparedMeasure> CompareMeasures(const JobEvaluation& a, const JobEvaluation& b);

// Preset, options, inputs and versions that differ.
std::vector<JobDifference> DifferencesOf(const v1::Job& a, const v1::Job& b);

}  // namespace weft
