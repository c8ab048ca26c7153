// What the report of a job is made of, read from the folder of its results.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/results/report/job_report.h"
#include "weft/v1/page.pb.h"

namespace weft {

// Values of vertices that the view in three dimensions can be coloured by, besides state and sigma.
struct VertexValues {
  std::string name, label, unit;  // "error", "error", "mm"
  ScalarRange range;
  // [vertices], NaN where there is none; empty: none in this frame.
  std::function<std::vector<double>(const std::string& frame,
                                    const std::vector<Eigen::Vector3d>& vertices_mm)>
      of_frame;
  bool is_first_shown = false;  // when the page opens, instead of state
};

// What an evaluation adds.
struct ReportExtras {
  std::vector<VertexValues> values;
  // Frames to be pictured besides those of the job, with the reason.
  std::vector<std::pair<std::string, std::string>> frames;
};

struct JobReportParts {
  v1::Job job;
  std::vector<v1::FrameReport> frames;
  std::vector<FramePictures> pictures;  // of the first, the worst and the last frames
  std::vector<std::string> notes;       // on what could not be read
  v1::PageSequence sequence;            // without frames where there are no meshes
};

// Errors: a folder that cannot be listed. What cannot be read of the frames is noted.
absl::StatusOr<JobReportParts> ReadJobReportParts(const std::string& out_folder, const v1::Job& job,
                                                  const ReportExtras& extras = {});

}  // namespace weft
