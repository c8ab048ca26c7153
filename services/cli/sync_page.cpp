#include "services/cli/sync_page.h"

#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "services/report/html_text.h"
#include "services/report/plot.h"
#include "services/report/report_sections.h"

namespace weft {
namespace {

std::string PartOf(const std::string& id, const std::string& heading, const std::string& body) {
  return body.empty() ? "" : Section(id, heading, body);
}

std::string Head(const v1::SyncReport& report) {
  return absl::StrFormat(
      "<header>\n<h1>Sync of take %s</h1>\n<p>%s. %s of %s complete, %s dropped. Between the cameras of a "
      "set: %s ms in "
      "the median, %s ms at worst.</p>\n</header>\n",
      NameHtml(report.take().id()), EscapeHtml(report.take().sync()),
      FormatCount(static_cast<int64_t>(report.sets_complete())),
      Counted(static_cast<int64_t>(report.sets()), "frame set", "frame sets"),
      FormatCount(static_cast<int64_t>(report.sets_dropped())), FormatNumber(report.spread_median_ms(), 4),
      FormatNumber(report.spread_worst_ms(), 4));
}

template <typename Lines>
std::string List(const Lines& lines) {
  std::string html;
  for (const std::string& line : lines) absl::StrAppend(&html, "<li>", EscapeHtml(line), "</li>\n");
  return html.empty() ? "" : absl::StrCat("<ul>\n", html, "</ul>\n");
}

std::string CameraTable(const v1::SyncReport& report) {
  std::string rows;
  for (int i = 0; i < report.timing_size(); ++i) {
    const v1::TakeTiming& timing = report.timing(i);
    const v1::CameraClock& clock = report.clocks(i);
    rows += TableRow(
        "td", {NameHtml(timing.camera()), FormatCount(static_cast<int64_t>(timing.frames())),
               FormatCount(static_cast<int64_t>(timing.missing())), FormatNumber(timing.offset_mean_ms(), 4),
               FormatNumber(timing.offset_jitter_ms(), 4), FormatNumber(timing.offset_worst_ms(), 4),
               FormatNumber(clock.drift_ppm(), 2), absl::StrCat(clock.jumps()),
               FormatNumber(clock.ptp_offset_rms_us(), 3), FormatNumber(clock.ptp_offset_worst_us(), 3),
               EscapeHtml(absl::StrJoin(clock.ptp_states(), ", "))});
  }
  return Table({"camera", "frames", "missing", "offset ms", "jitter ms", "worst ms", "drift ppm", "jumps",
                "PTP rms &micro;s", "PTP worst &micro;s", "PTP"},
               rows, "");
}

std::string Causes(const v1::SyncReport& report) {
  std::vector<std::string> lines;
  for (const v1::TakeCause& cause : report.causes())
    lines.push_back(absl::StrCat(cause.camera().empty() ? "dropped" : "camera " + cause.camera(), ": ",
                                 cause.count(), " of: ", cause.cause()));
  return List(lines);
}

PlotFrames Readings(size_t count) {
  PlotFrames frames;
  frames.noun = "reading";
  for (size_t i = 0; i < count; ++i) frames.names.push_back(absl::StrCat(i));
  frames.without_mesh.assign(count, false);
  return frames;
}

std::string Plots(const SyncAnalysis& analysis, std::vector<double> CameraSyncSeries::*values,
                  const char* what, const char* unit, const PlotFrames* sets) {
  std::string html;
  for (const CameraSyncSeries& series : analysis.series) {
    const std::vector<double>& of = series.*values;
    bool any = false;
    for (const double value : of) any = any || std::isfinite(value);
    if (!any) continue;
    const PlotText text{absl::StrCat(what, ", camera ", series.camera), unit, 4, false};
    html += LinePlot(sets != nullptr ? *sets : Readings(of.size()), of, text);
  }
  return html;
}

}  // namespace

std::string SyncPage(const SyncAnalysis& analysis) {
  const v1::SyncReport& report = analysis.report;
  PlotFrames sets;
  sets.noun = "set";
  sets.names = analysis.set_names;
  sets.without_mesh.assign(sets.names.size(), false);
  return Page("Weft sync report",
              absl::StrCat(Head(report), PartOf("findings", "Findings", List(report.findings())),
                           PartOf("cameras", "Cameras", CameraTable(report)),
                           PartOf("missing", "Missing frames", Causes(report)),
                           PartOf("events", "Events", List(report.notes())),
                           PartOf("offsets", "Offset from the other cameras",
                                  Plots(analysis, &CameraSyncSeries::offset_ms, "Offset", "ms", &sets)),
                           PartOf("clocks", "Clock against the host",
                                  Plots(analysis, &CameraSyncSeries::clock_ms, "Since the first reading",
                                        "ms", nullptr)),
                           PartOf("ptp", "Offset from the PTP master",
                                  Plots(analysis, &CameraSyncSeries::ptp_us, "PTP offset", "us", nullptr))));
}

}  // namespace weft
