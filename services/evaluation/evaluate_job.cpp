#include "services/evaluation/evaluate_job.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/evaluation/evaluation_verdict.h"

namespace weft {
namespace {

// Sums and counts per vertex.
class FieldMean {
 public:
  void Add(const std::vector<double>& values) {
    if (sum_.size() < values.size()) sum_.resize(values.size()), count_.resize(values.size());
    for (size_t v = 0; v < values.size(); ++v)
      if (std::isfinite(values[v])) sum_[v] += values[v], ++count_[v];
  }
  std::vector<double> Mean(double scale = 1) const {
    std::vector<double> mean(sum_.size(), std::numeric_limits<double>::quiet_NaN());
    for (size_t v = 0; v < sum_.size(); ++v)
      if (count_[v] > 0) mean[v] = scale * sum_[v] / count_[v];
    return mean;
  }

 private:
  std::vector<double> sum_;
  std::vector<int> count_;
};

std::optional<ErrorSummary> MeanOf(const std::vector<EvaluatedFrame>& frames,
                                   std::optional<ErrorSummary> FrameMetrics::*field) {
  ErrorSummary total;
  for (const EvaluatedFrame& frame : frames) {
    const std::optional<ErrorSummary>& one = frame.metrics.*field;
    if (!one) continue;
    const auto weight = static_cast<double>(one->count);
    total.count += one->count;
    total.mean += weight * one->mean, total.median += weight * one->median, total.p95 += weight * one->p95;
    total.p99 += weight * one->p99;
    total.max = std::max(total.max, one->max);
  }
  if (total.count == 0) return std::nullopt;
  const auto count = static_cast<double>(total.count);
  total.mean /= count, total.median /= count, total.p95 /= count, total.p99 /= count;
  return total;
}

template <typename T>
std::optional<T> MeanOf(const std::vector<EvaluatedFrame>& frames, std::optional<T> FrameMetrics::*field) {
  double sum = 0;
  int count = 0;
  for (const EvaluatedFrame& frame : frames)
    if (frame.metrics.*field) sum += static_cast<double>(*(frame.metrics.*field)), ++count;
  if (count == 0) return std::nullopt;
  return static_cast<T>(sum / count);
}

FrameMetrics Total(const std::vector<EvaluatedFrame>& frames) {
  FrameMetrics total;
  for (const auto field :
       {&FrameMetrics::coverage, &FrameMetrics::two_view_share, &FrameMetrics::distortion_mm,
        &FrameMetrics::distortion_relative, &FrameMetrics::texture_flow_lost})
    total.*field = MeanOf(frames, field);
  for (const auto field :
       {&FrameMetrics::texture_drift_mm, &FrameMetrics::texture_drift_mm_s,
        &FrameMetrics::true_drift_observed_mm, &FrameMetrics::true_drift_inferred_mm,
        &FrameMetrics::true_drift_observed_mm_s, &FrameMetrics::true_drift_inferred_mm_s,
        &FrameMetrics::jitter_observed_mm, &FrameMetrics::jitter_inferred_mm, &FrameMetrics::error_change_mm,
        &FrameMetrics::error_change_mm_s, &FrameMetrics::jitter_of_truth_mm,
        &FrameMetrics::error_jitter_observed_mm, &FrameMetrics::error_jitter_inferred_mm,
        &FrameMetrics::reprojection_px, &FrameMetrics::left_out_px})
    total.*field = MeanOf(frames, field);
  for (const EvaluatedFrame& frame : frames)
    if (frame.metrics.self_intersections)
      total.self_intersections = total.self_intersections.value_or(0) + *frame.metrics.self_intersections;
  return total;
}

// Why a measure stayed empty although its inputs were there.
void ExplainGaps(const EvaluationRequest& request, const EvaluationInputs& inputs, JobEvaluation& out) {
  const auto remark = [&](const char* metric, const char* reason) {
    out.remarks.push_back({metric, reason});
  };
  const FrameMetrics& total = out.total_metrics;
  if (inputs.rig && !total.reprojection_px)
    remark("reprojection, leave-one-camera-out",
           "there is no observations.csv; register with --observations");
  if (inputs.garment && !total.coverage)
    remark("coverage, visibility", "no mesh.ply has the states of its vertices");
  if (!total.jitter_observed_mm)
    remark("jitter", "no three consecutive frames have a mesh with the states of its vertices");
  if (request.quick) {
    remark("geodesic distortion, texture drift", "left out on request (--quick)");
  } else if (inputs.dump && inputs.garment && !total.texture_drift_mm) {
    remark("texture drift", "no two consecutive frames have a mesh and pictures that show the same cells");
  }
  const bool any_mesh = std::any_of(out.frames.begin(), out.frames.end(), [](const EvaluatedFrame& frame) {
    return frame.metrics.self_intersections.has_value();
  });
  if (!inputs.truth.empty() && any_mesh && !out.total.mesh) {
    remark("vertex error, exact drift",
           "the result's mesh has other vertices than the truth's, and only templates relate them: "
           "give --template, and keep the take's template beside its truth");
  } else if (inputs.garment && !inputs.truth.empty() && !total.true_drift_observed_mm) {
    remark("exact drift", "no two consecutive frames have a mesh");
  }
}

}  // namespace

absl::StatusOr<JobEvaluation> EvaluateJob(const EvaluationRequest& request,
                                          const std::function<void(size_t, size_t)>& on_frame) {
  absl::StatusOr<EvaluationInputs> inputs = LoadEvaluationInputs(request);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<EvaluationTools> tools = PrepareTools(request, *inputs);
  if (!tools.ok()) return tools.status();
  JobEvaluation out;
  out.remarks = inputs->remarks;
  out.result = inputs->result, out.truth = inputs->truth, out.dump = inputs->dump_path;
  out.fps = inputs->fps, out.fps_source = inputs->fps_source;
  if (inputs->garment) out.shape = inputs->garment->rest;

  FieldMean visibility, error, distortion, texture_drift, true_drift;
  const size_t all = inputs->frames.size();
  const size_t batch = 4 * static_cast<size_t>(tbb::this_task_arena::max_concurrency());
  size_t done = 0;
  std::mutex mutex;
  // Batches are added up in the order of the frames, so that sums do not depend on which frame was ready
  // first.
  for (size_t begin = 0; begin < all; begin += batch) {
    std::vector<absl::StatusOr<FrameOutcome>> outcomes(std::min(batch, all - begin));
    tbb::parallel_for(size_t{0}, outcomes.size(), [&](size_t i) {
      outcomes[i] = EvaluateFrame(request, *inputs, *tools, begin + i);
      const std::lock_guard lock(mutex);
      ++done;
      if (on_frame) on_frame(done, all);
    });
    for (absl::StatusOr<FrameOutcome>& outcome : outcomes) {
      if (!outcome.ok()) return outcome.status();
      visibility.Add(outcome->fields.observed);
      error.Add(outcome->fields.error_mm);
      distortion.Add(outcome->fields.distortion_mm);
      texture_drift.Add(outcome->fields.texture_drift_mm);
      true_drift.Add(outcome->fields.true_drift_mm);
      out.cameras.resize(std::max(out.cameras.size(), outcome->cameras.size()));
      for (size_t c = 0; c < outcome->cameras.size(); ++c) out.cameras[c] += outcome->cameras[c];
      out.total += outcome->frame.score;
      out.frames.push_back(std::move(outcome->frame));
    }
  }
  if (std::all_of(out.frames.begin(), out.frames.end(),
                  [](const auto& frame) { return frame.missing.size() == 3; })) {
    return absl::NotFoundError(
        absl::StrCat(request.result, ": holds no observations.csv, cloud.ply or mesh.ply of any of the ", all,
                     " frames", inputs->truth.empty() ? "" : absl::StrCat(" of ", inputs->truth),
                     "; give the --out folder of `weft register`"));
  }
  out.total_metrics = Total(out.frames);
  const double per_frame = out.fps > 0 ? out.fps : 1;
  out.maps = {visibility.Mean(), error.Mean(), distortion.Mean(), texture_drift.Mean(per_frame),
              true_drift.Mean(per_frame)};
  ExplainGaps(request, *inputs, out);
  out.verdict = VerdictOf(out);
  return out;
}

}  // namespace weft
