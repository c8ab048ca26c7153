// How well the cameras of a take kept together.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/take.pb.h"

namespace weft {

// One camera over the take, for plots; NaN where there is nothing.
struct CameraSyncSeries {
  std::string camera;
  std::vector<double> offset_ms;  // [sets], to the middle one of the cameras
  std::vector<double> clock_ms;   // [readings], of its clock to the host's, since the first
  std::vector<double> ptp_us;     // [readings], from its PTP master
};

struct SyncAnalysis {
  v1::SyncReport report;
  std::vector<std::string> set_names;  // [sets]
  std::vector<CameraSyncSeries> series;
};

// Errors of DescribeTake.
absl::StatusOr<SyncAnalysis> AnalyzeSync(const std::string& take);

std::string SyncReportText(const v1::SyncReport& report);

}  // namespace weft
