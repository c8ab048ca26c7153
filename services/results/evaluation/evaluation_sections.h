// Sections of the page of an evaluation; empty where there is nothing to tell.
#pragma once

#include <string>

#include "services/results/evaluation/evaluate_job.h"
#include "services/results/report/paper_table.h"

namespace weft {

// What stands beside the paper's figures.
PaperFigures FiguresOf(const JobEvaluation& evaluation);

std::string EvaluationHead(const JobEvaluation& evaluation);
std::string MapSection(const JobEvaluation& evaluation);
std::string VisibilitySection(const JobEvaluation& evaluation);
std::string FramePlotSection(const JobEvaluation& evaluation);
std::string FrameTableSection(const JobEvaluation& evaluation);
std::string CameraTableSection(const JobEvaluation& evaluation);
std::string RemarkSection(const JobEvaluation& evaluation);

}  // namespace weft
