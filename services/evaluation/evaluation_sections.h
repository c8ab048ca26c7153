// Sections of the page of an evaluation; empty where there is nothing to tell.
#pragma once

#include <string>

#include "services/evaluation/evaluate_job.h"

namespace weft {

std::string EvaluationHead(const JobEvaluation& evaluation);
std::string PaperSection(const JobEvaluation& evaluation);
std::string MapSection(const JobEvaluation& evaluation);
std::string VisibilitySection(const JobEvaluation& evaluation);
std::string FramePlotSection(const JobEvaluation& evaluation);
std::string FrameTableSection(const JobEvaluation& evaluation);
std::string CameraTableSection(const JobEvaluation& evaluation);
std::string RemarkSection(const JobEvaluation& evaluation);

}  // namespace weft
