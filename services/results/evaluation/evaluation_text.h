// An evaluation to read on a terminal, as JSON, and as tables of comma-separated values.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "services/results/evaluation/evaluate_job.h"
#include "weft/v1/evaluation.pb.h"

namespace weft {

// With a truth a line per frame and one for the total; the other measures of all frames below; what could not
// be measured, and why.
std::string EvaluationTable(const JobEvaluation& evaluation);
v1::Evaluation EvaluationMessage(const JobEvaluation& evaluation);
// A line per frame; columns that no frame fills stay empty.
std::string FrameCsv(const JobEvaluation& evaluation);
// A line per camera.
std::string CameraCsv(const JobEvaluation& evaluation);

v1::CameraScore CameraScoreMessage(const CameraErrors& errors);
v1::ErrorSummary ErrorSummaryMessage(const ErrorSummary& summary);

// Vertices by the share of frames that observe them, in ten equal steps from 0 to 1; all 0 where it is not
// known.
std::array<int, 10> VisibilityHistogram(const std::vector<double>& visibility);

}  // namespace weft
