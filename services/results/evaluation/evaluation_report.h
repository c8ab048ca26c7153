// An evaluation as one self-contained HTML page, and all files of `weft evaluate --out`.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "services/results/evaluation/evaluate_job.h"

namespace weft {

struct JobReportParts;

// Tiles, the table beside the paper's, maps on the garment, plots over the frames, visibility (paper, Fig.
// 7), tables of frames and cameras, remarks. With `job` all of the job's report besides: its verdict, the
// meshes in three dimensions, pictures of the worst frames, timings, options, inputs. The same bytes for the
// same evaluation.
std::string MakeEvaluationReport(const JobEvaluation& evaluation, const JobReportParts* job = nullptr);

// <folder>/{evaluation.json,frames.csv,cameras.csv,report.html}; the folder is made where it is missing. The
// page has what the result's job.json, reports and meshes tell, coloured by error as well where there is a
// truth. Errors of WriteFileAtomically; InvalidArgument names a job.json that cannot be read.
absl::Status WriteEvaluation(const std::string& folder, const JobEvaluation& evaluation);

}  // namespace weft
