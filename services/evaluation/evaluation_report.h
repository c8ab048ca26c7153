// An evaluation as one self-contained HTML page, and all files of `weft evaluate --out`.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "services/evaluation/evaluate_job.h"

namespace weft {

// Tiles, the table beside the paper's, maps on the garment, plots over the frames, visibility (paper, Fig.
// 7), tables of frames and cameras, remarks. The same bytes for the same evaluation.
std::string MakeEvaluationReport(const JobEvaluation& evaluation);

// <folder>/{evaluation.json,frames.csv,cameras.csv,report.html}; the folder is made where it is missing.
// Errors of WriteFileAtomically.
absl::Status WriteEvaluation(const std::string& folder, const JobEvaluation& evaluation);

}  // namespace weft
