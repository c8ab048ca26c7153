#include "services/tools/cli/sync_page.h"

#include "services/results/report/page.h"
#include "services/studio/recording/take_words.h"
#include "weft/v1/page_reports.pb.h"

namespace weft {

std::string SyncPage(const SyncAnalysis& analysis) {
  v1::SyncPage page;
  *page.mutable_set_names() = {analysis.set_names.begin(), analysis.set_names.end()};
  for (const CameraSyncSeries& series : analysis.series) {
    v1::SyncPage::Series& to = *page.add_series();
    to.set_camera(series.camera);
    to.mutable_offset_ms()->Assign(series.offset_ms.begin(), series.offset_ms.end());
    to.mutable_clock_ms()->Assign(series.clock_ms.begin(), series.clock_ms.end());
    to.mutable_ptp_us()->Assign(series.ptp_us.begin(), series.ptp_us.end());
  }
  for (const std::string& line : CauseLines(analysis.report.causes())) page.add_causes(line);
  return MakePage(
      {.title = "Weft sync report", .kind = "sync", .data = {{"report", &analysis.report}, {"page", &page}}});
}

}  // namespace weft
