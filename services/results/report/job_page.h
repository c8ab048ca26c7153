// What the page of a job's report holds.
#pragma once

#include "services/results/report/job_report_parts.h"
#include "weft/v1/page_job.pb.h"

namespace weft {

// A job that ended without a verdict, as in earlier versions, gets one; one that runs has none.
v1::JobPage JobPageOf(JobReportParts parts);

}  // namespace weft
