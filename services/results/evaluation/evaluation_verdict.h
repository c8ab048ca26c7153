// Is the result good? By the limits of docs/verdicts.md.
#pragma once

#include "services/results/evaluation/evaluate_job.h"

namespace weft {

// Of the measures that are there; `evaluation` needs no verdict of its own yet.
v1::Verdict VerdictOf(const JobEvaluation& evaluation);

// "5 frames, 98.7 % of the cells seen by three cameras or more".
std::string EvaluationHeadline(const JobEvaluation& evaluation);

}  // namespace weft
