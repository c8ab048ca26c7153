// The result folder of a job, measured with ground truth and without.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/formats/verdict/camera_checks.h"
#include "services/results/evaluation/evaluate_frame.h"
#include "services/results/evaluation/field_mean.h"
#include "weft/v1/verdict.pb.h"

namespace weft {

// Means over the frames, [vertices]; NaN where no frame has a value, empty where it was not measured at all.
struct VertexMaps {
  std::vector<double> visibility;  // share of the frames that observe the vertex (paper, Fig. 7)
  std::vector<double> error_mm, distortion_mm;
  std::vector<double> texture_drift, true_drift;  // mm/s, or mm a frame where the frame rate is not known
};

struct JobEvaluation {
  std::vector<EvaluatedFrame> frames;
  FrameScore total;  // over all frames; what is missing adds nothing
  // Over all frames. Counts add up and the largest error is that of all; means, medians and percentiles are
  // means of those of the frames, weighted by their counts.
  FrameMetrics total_metrics;
  VertexMaps maps;
  std::vector<CameraErrors> cameras;  // of all frames
  TriangleMesh shape;                 // the template, to draw the maps on; empty where there is none
  std::vector<EvaluationRemark> remarks;
  std::string result, truth, dump, job_id;
  bool is_driven = false;                    // by an avatar, before too few cameras to observe all cells
  std::optional<TruthByNode> truth_by_node;  // as in EvaluationInputs
  double fps = 0;                            // 0: not known
  std::string fps_source;                    // "--fps", "the take's times"
  CameraFacts facts;                         // from the reports of the frames
  v1::Verdict verdict;
};

// Adds up the frames of a job.
class EvaluationSum {
 public:
  // Frames in the order of time.
  void Add(FrameOutcome outcome);
  // NotFound: no frame had a file of the result.
  absl::StatusOr<JobEvaluation> Finish(const EvaluationRequest& request, const EvaluationInputs& inputs);

 private:
  JobEvaluation out_;
  FieldMean visibility_, error_, distortion_, texture_drift_, true_drift_;
};

// Measures every frame, several at a time in the calling thread's TBB arena; the same numbers at any thread
// count. `on_frame` (may be empty) is called with frames done and all, from any thread, calls never overlap.
// NotFound when the result holds no file of any frame. Errors name the file.
absl::StatusOr<JobEvaluation> EvaluateJob(const EvaluationRequest& request,
                                          const std::function<void(size_t, size_t)>& on_frame = {});

}  // namespace weft
