#include "services/results/evaluation/evaluate_job.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "services/results/evaluation/evaluation_measures.h"
#include "services/results/evaluation/evaluation_verdict.h"
#include "services/results/report/camera_facts.h"
#include "services/results/report/job_frames.h"

namespace weft {
namespace {

std::optional<ErrorSummary> OverFrames(const std::vector<EvaluatedFrame>& frames,
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

std::optional<double> OverFrames(const std::vector<EvaluatedFrame>& frames,
                                 std::optional<double> FrameMetrics::*field) {
  double sum = 0;
  int count = 0;
  for (const EvaluatedFrame& frame : frames)
    if (frame.metrics.*field) sum += *(frame.metrics.*field), ++count;
  if (count == 0) return std::nullopt;
  return sum / count;
}

std::optional<int64_t> OverFrames(const std::vector<EvaluatedFrame>& frames,
                                  std::optional<int64_t> FrameMetrics::*field) {
  std::optional<int64_t> sum;  // counts add up
  for (const EvaluatedFrame& frame : frames)
    if (frame.metrics.*field) sum = sum.value_or(0) + *(frame.metrics.*field);
  return sum;
}

FrameMetrics Total(const std::vector<EvaluatedFrame>& frames) {
  FrameMetrics total;
  for (const FrameMetric& metric : FrameMetricFields())
    std::visit([&](auto field) { total.*field = OverFrames(frames, field); }, metric.field);
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
  if (inputs.garment && !inputs.printed) {
    remark("coverage, visibility, texture drift", "no board was printed on the garment, so no cells tell");
  } else if (inputs.garment && !total.coverage) {
    remark("coverage, visibility", "no mesh.ply has the states of its vertices");
  }
  if (!total.jitter_observed_mm)
    remark("jitter", "no three consecutive frames have a mesh with the states of its vertices");
  if (request.quick) {
    remark("geodesic distortion, texture drift", "left out on request (--quick)");
  } else if (inputs.dump && inputs.printed && !total.texture_drift_mm) {
    remark("texture drift", "no two consecutive frames have a mesh and pictures that show the same cells");
  }
  const bool any_mesh = std::ranges::any_of(
      out.frames, [](const EvaluatedFrame& frame) { return frame.metrics.self_intersections.has_value(); });
  if (!inputs.truth.empty() && any_mesh && !out.total.mesh) {
    remark("vertex error, exact drift",
           "the result's mesh has other vertices than the truth's, and only templates relate them: "
           "give --template, and keep the take's template beside its truth");
  } else if (inputs.garment && !inputs.truth.empty() && !total.true_drift_observed_mm) {
    remark("exact drift", "no two consecutive frames have a mesh");
  }
}

}  // namespace

void EvaluationSum::Add(FrameOutcome outcome) {
  visibility_.Add(outcome.fields.observed);
  error_.Add(outcome.fields.error_mm);
  distortion_.Add(outcome.fields.distortion_mm);
  texture_drift_.Add(outcome.fields.texture_drift_mm);
  true_drift_.Add(outcome.fields.true_drift_mm);
  out_.cameras.resize(std::max(out_.cameras.size(), outcome.cameras.size()));
  for (size_t c = 0; c < outcome.cameras.size(); ++c) out_.cameras[c] += outcome.cameras[c];
  out_.total += outcome.frame.score;
  outcome.frame.score.Seal();  // errors of all vertices of all frames would be gigabytes
  out_.frames.push_back(std::move(outcome.frame));
}

absl::StatusOr<JobEvaluation> EvaluationSum::Finish(const EvaluationRequest& request,
                                                    const EvaluationInputs& inputs) {
  if (std::ranges::all_of(out_.frames, [](const auto& frame) { return frame.missing.size() == 3; })) {
    return absl::NotFoundError(absl::StrCat(
        request.result, ": holds no observations.csv, cloud.ply or mesh.ply of any of the ",
        out_.frames.size(), " frames", inputs.truth.empty() ? "" : absl::StrCat(" of ", inputs.truth),
        "; give the --out folder of `weft register`"));
  }
  out_.remarks = inputs.remarks;
  out_.result = inputs.result, out_.truth = inputs.truth, out_.dump = inputs.dump_path;
  out_.job_id = inputs.job.id();
  out_.is_driven = inputs.job.has_driven();
  out_.fps = inputs.fps, out_.fps_source = inputs.fps_source;
  out_.truth_by_node = inputs.truth_by_node;
  if (inputs.garment) out_.shape = inputs.garment->rest;
  out_.total_metrics = Total(out_.frames);
  const double per_frame = out_.fps > 0 ? out_.fps : 1;
  out_.maps = {visibility_.Mean(), error_.Mean(), distortion_.Mean(), texture_drift_.Mean(per_frame),
               true_drift_.Mean(per_frame)};
  ExplainGaps(request, inputs, out_);
  std::vector<v1::FrameReport> reports;
  for (const auto& [frame, report] : inputs.reports) reports.push_back(report);
  out_.facts = FactsOf(reports);
  out_.verdict = VerdictOf(out_);
  return std::move(out_);
}

absl::StatusOr<JobEvaluation> EvaluateJob(const EvaluationRequest& request,
                                          const std::function<void(size_t, size_t)>& on_frame) {
  WEFT_ASSIGN_OR_RETURN(EvaluationInputs inputs, LoadEvaluationInputs(request));
  WEFT_ASSIGN_OR_RETURN(const EvaluationTools tools, PrepareTools(request, inputs));
  EvaluationSum sum;
  const size_t all = inputs.frames.size();
  const size_t batch = 4 * static_cast<size_t>(tbb::this_task_arena::max_concurrency());
  struct {
    Mutex mutex;
    size_t done ABSL_GUARDED_BY(mutex) = 0;
  } progress;
  // Batches are added up in the order of the frames, so that sums do not depend on which frame was ready
  // first.
  for (size_t begin = 0; begin < all; begin += batch) {
    std::vector<absl::StatusOr<FrameOutcome>> outcomes(std::min(batch, all - begin));
    tbb::parallel_for(size_t{0}, outcomes.size(), [&](size_t i) {
      outcomes[i] = EvaluateFrame(request, inputs, tools, begin + i);
      const MutexLock lock(progress.mutex);
      ++progress.done;
      if (on_frame) on_frame(progress.done, all);
    });
    for (absl::StatusOr<FrameOutcome>& outcome : outcomes) {
      if (!outcome.ok()) return outcome.status();
      sum.Add(*std::move(outcome));
    }
  }
  return sum.Finish(request, inputs);
}

}  // namespace weft
