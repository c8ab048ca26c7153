// An evaluation as a table to read and as JSON.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "services/evaluation/evaluate_job.h"

namespace weft {

// A line per frame and one for the total; pieces that are missing say so.
std::string EvaluationTable(const JobEvaluation& evaluation);
// weft.v1.Evaluation.
absl::StatusOr<std::string> EvaluationJson(const JobEvaluation& evaluation);

}  // namespace weft
