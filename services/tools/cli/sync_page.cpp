#include "services/tools/cli/sync_page.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "services/results/report/heat_map.h"
#include "services/results/report/html_text.h"
#include "services/results/report/plot.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/verdict_html.h"
#include "services/studio/recording/take_words.h"

namespace weft {
namespace {

constexpr size_t kPlottedAlone = 6;  // cameras

std::string PartOf(const std::string& id, const std::string& heading, const std::string& body) {
  return body.empty() ? "" : Section(id, heading, body);
}

std::string Head(const v1::SyncReport& report) {
  const std::string sync = report.take().sync().empty() ? "" : EscapeHtml(report.take().sync()) + ". ";
  return PageHead(
      absl::StrCat("Weft sync of take ", NameHtml(report.take().id())), report.verdict().reason(),
      report.verdict(),
      absl::StrCat("<p>", sync, FormatCount(static_cast<int64_t>(report.sets_complete())), " of ",
                   Counted(static_cast<int64_t>(report.sets()), "frame set", "frame sets"), " complete, ",
                   FormatCount(static_cast<int64_t>(report.sets_dropped())),
                   " dropped. Between the cameras of a set: ", FormatNumber(report.spread_median_ms(), 4),
                   " ms in the median, ", FormatNumber(report.spread_worst_ms(), 4), " ms at worst.</p>\n"));
}

template <typename Lines>
std::string List(const Lines& lines) {
  std::string html;
  for (const std::string& line : lines) absl::StrAppend(&html, "<li>", EscapeHtml(line), "</li>\n");
  return html.empty() ? "" : absl::StrCat("<ul>\n", html, "</ul>\n");
}

// What a camera has not is no 0.
std::string Known(bool is_known, double value, int decimals) {
  return FormatNumber(is_known ? value : std::nan(""), decimals);
}

std::string CameraTable(const v1::SyncReport& report) {
  std::string rows;
  for (int i = 0; i < report.timing_size(); ++i) {
    const v1::TakeTiming& timing = report.timing(i);
    const v1::CameraClock& clock = report.clocks(i);
    const bool has_ptp = clock.ptp_states_size() > 0;
    rows += TableRow(
        "td", {NameHtml(timing.camera()), FormatCount(static_cast<int64_t>(timing.frames())),
               FormatCount(static_cast<int64_t>(timing.missing())), FormatNumber(timing.offset_mean_ms(), 4),
               FormatNumber(timing.offset_jitter_ms(), 4), FormatNumber(timing.offset_worst_ms(), 4),
               Known(clock.readings() > 1, clock.drift_ppm(), 2), absl::StrCat(clock.jumps()),
               Known(has_ptp, clock.ptp_offset_rms_us(), 3), Known(has_ptp, clock.ptp_offset_worst_us(), 3),
               has_ptp ? EscapeHtml(absl::StrJoin(clock.ptp_states(), ", ")) : "-"});
  }
  return Table({"camera", "frames", "missing", "offset ms", "jitter ms", "worst ms", "drift ppm", "jumps",
                "PTP rms &micro;s", "PTP worst &micro;s", "PTP"},
               rows, "");
}

PlotFrames Named(const char* noun, std::vector<std::string> names) {
  PlotFrames frames;
  frames.noun = noun;
  frames.without_mesh.assign(names.size(), false);
  frames.names = std::move(names);
  return frames;
}

PlotFrames Readings(size_t count) {
  std::vector<std::string> names;
  for (size_t i = 0; i < count; ++i) names.push_back(absl::StrCat(i));
  return Named("reading", std::move(names));
}

struct Series {
  std::vector<double> CameraSyncSeries::*values;
  const char* what;
  const char* unit;
  HeatMapGaps gaps;
};

double Farthest(const std::vector<double>& values) {
  double farthest = -1;  // where there is no value
  for (const double value : values)
    if (std::isfinite(value)) farthest = std::max(farthest, std::abs(value));
  return farthest;
}

// All cameras in one picture, and a plot each of those that stray farthest.
std::string Plots(const SyncAnalysis& analysis, const Series& of, const PlotFrames* sets) {
  std::vector<const CameraSyncSeries*> order;
  size_t longest = 0;
  for (const CameraSyncSeries& series : analysis.series) {
    if (Farthest(series.*of.values) >= 0) order.push_back(&series);
    longest = std::max(longest, (series.*of.values).size());
  }
  if (order.empty()) return "";
  const PlotFrames frames = sets != nullptr ? *sets : Readings(longest);
  std::string html;
  if (analysis.series.size() > 1) {
    std::vector<HeatMapRow> rows;
    for (const CameraSyncSeries& series : analysis.series) {
      HeatMapRow row{series.camera, series.*of.values, ""};
      const auto lacking = std::ranges::count_if(row.values, [](double v) { return !std::isfinite(v); });
      if (const double farthest = Farthest(row.values); farthest >= 0)
        row.note = absl::StrFormat(": at most %.3f %s from 0", farthest, of.unit);
      if (sets != nullptr && lacking > 0)
        absl::StrAppend(&row.note, ", ", Counted(lacking, "frame", "frames"), " missing");
      row.values.resize(frames.names.size(), std::nan(""));
      rows.push_back(std::move(row));
    }
    html += HeatMap(frames, rows, {absl::StrCat(of.what, ", all cameras"), of.unit, 4, false}, of.gaps);
  }
  if (order.size() > kPlottedAlone) {
    std::ranges::stable_sort(order, [&](const auto* a, const auto* b) {
      return Farthest(a->*of.values) > Farthest(b->*of.values);
    });
    order.resize(kPlottedAlone);
  }
  html += "<div class=\"plots\">";
  for (const CameraSyncSeries* series : order) {
    const std::vector<double>& values = series->*of.values;
    const PlotText text{absl::StrCat(of.what, ", camera ", series->camera), of.unit, 4, false};
    html += LinePlot(sets != nullptr ? *sets : Readings(values.size()), values, text);
  }
  return html + "</div>\n";
}

}  // namespace

std::string SyncPage(const SyncAnalysis& analysis) {
  const v1::SyncReport& report = analysis.report;
  const PlotFrames sets = Named("set", analysis.set_names);
  const Series offsets = {&CameraSyncSeries::offset_ms, "Offset", "ms", HeatMapGaps::kAreFaults},
               clocks = {&CameraSyncSeries::clock_ms, "Since the first reading", "ms",
                         HeatMapGaps::kAreBlank},
               ptp = {&CameraSyncSeries::ptp_us, "PTP offset", "us", HeatMapGaps::kAreBlank};
  return Page(
      "Weft sync report",
      absl::StrCat(Head(report), PartOf("findings", "Findings", List(report.findings())),
                   PartOf("offsets", "Offset from the other cameras", Plots(analysis, offsets, &sets)),
                   PartOf("missing", "Missing frames", List(CauseLines(report.causes()))),
                   PartOf("cameras", "Cameras", CameraTable(report)),
                   PartOf("clocks", "Clock against the host", Plots(analysis, clocks, nullptr)),
                   PartOf("ptp", "Offset from the PTP master", Plots(analysis, ptp, nullptr)),
                   PartOf("events", "Events", List(report.notes()))));
}

}  // namespace weft
