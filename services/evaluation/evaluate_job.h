// The result folder of a job against the truth of a synthetic take.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "evaluation/truth_score.h"

namespace weft {

struct EvaluatedFrame {
  std::string frame;
  std::vector<std::string> missing;  // file names of the result that are not there
  FrameScore score;
};

struct JobEvaluation {
  std::vector<EvaluatedFrame> frames;  // every frame of the truth
  FrameScore total;                    // over all frames; what is missing adds nothing
};

// Reads <result>/<frame>/{observations.csv,cloud.ply,mesh.ply} for every frame of the truth. `on_frame` (may
// be empty) is called with frames done and all. NotFound when the result holds none of these files. Errors
// name the file.
absl::StatusOr<JobEvaluation> EvaluateJob(const std::string& result_folder, const std::string& truth_folder,
                                          const EvaluationOptions& options,
                                          const std::function<void(size_t, size_t)>& on_frame = {});

}  // namespace weft
