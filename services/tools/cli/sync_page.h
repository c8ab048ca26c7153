// The sync report as a page.
#pragma once

#include <string>

#include "services/studio/recording/sync_report.h"

namespace weft {

// One self-contained HTML page: the verdict, findings, offsets of all cameras over the sets in one picture,
// causes of missing frames, clocks and PTP over the readings. The cameras that stray farthest have a plot
// each.
std::string SyncPage(const SyncAnalysis& analysis);

}  // namespace weft
