// The sync report as a page.
#pragma once

#include <string>

#include "services/recording/sync_report.h"

namespace weft {

// One self-contained HTML page: findings, offsets and PTP in words, a plot of every camera's offset over the
// sets and of its clock and PTP over the readings.
std::string SyncPage(const SyncAnalysis& analysis);

}  // namespace weft
