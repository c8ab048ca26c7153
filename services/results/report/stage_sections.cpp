// The sections about stages: cells without a point, garments, and alignment.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/results/report/html_text.h"
#include "services/results/report/report_sections.h"

namespace weft {
namespace {

// What the reasons of triangulation/cloud.h mean to an operator; empty for others.
std::string Explanation(const std::string& reason) {
  if (reason == "too_few_views")
    return "seen by fewer cameras than triangulation needs: add cameras on that side, or move them closer";
  if (reason == "no_consensus")
    return "the rays of the cameras do not meet: wrong observations, or a camera that has moved";
  if (reason == "poor_geometry") return "the rays are nearly parallel: the cameras are too close together";
  if (reason == "isolated") return "too few neighbours around it to be trusted";
  if (reason == "stretched_edges") return "farther from its neighbours than cloth stretches";
  if (reason == "small_component") return "part of a small piece far from trusted ones";
  if (reason == "unconfirmed") return "seen by two cameras, without neighbours that confirm it";
  return "";
}

std::string EnergyText(double energy) {
  if (!std::isfinite(energy)) return "\xE2\x80\x93";
  if (std::abs(energy) >= 1000 && std::abs(energy) < 1e12) return FormatCount(std::llround(energy));
  return absl::StrFormat("%.4g", energy);
}

// One alignment stage over the frames.
struct StageSummary {
  std::string name;
  std::vector<double> iterations, before, after, time_ms;
};

std::vector<StageSummary> SummarizeStages(const std::vector<v1::FrameReport>& frames) {
  std::vector<StageSummary> stages;
  for (const v1::FrameReport& frame : frames) {
    for (const v1::AlignmentStage& entry : frame.mesh().stages()) {
      auto stage =
          std::ranges::find_if(stages, [&](const StageSummary& s) { return s.name == entry.name(); });
      if (stage == stages.end()) stage = stages.insert(stages.end(), StageSummary{.name = entry.name()});
      stage->iterations.push_back(entry.iterations());
      stage->before.push_back(entry.energy_before());
      stage->after.push_back(entry.energy_after());
      stage->time_ms.push_back(entry.time_ms());
    }
  }
  return stages;
}

}  // namespace

std::string CellSection(const std::vector<v1::FrameReport>& frames) {
  std::map<std::string, int64_t> totals;
  int64_t points = 0, unclaimed = 0, clouds = 0;
  for (const v1::FrameReport& frame : frames) {
    if (!frame.has_cloud()) continue;
    ++clouds;
    points += int64_t{frame.cloud().centers()} + frame.cloud().corners();
    unclaimed += frame.mesh().unclaimed_points();
    for (const v1::ReasonCount& rejected : frame.cloud().rejected())
      totals[rejected.reason()] += rejected.count();
  }
  if (clouds == 0) return "";
  std::vector<std::pair<std::string, int64_t>> reasons(totals.begin(), totals.end());
  std::ranges::stable_sort(reasons, [](const auto& a, const auto& b) { return a.second > b.second; });
  const auto per_frame = [&](int64_t count) {
    const double mean = static_cast<double>(count) / static_cast<double>(clouds);
    return clouds > 1 && count > 0 && mean < 9.95 ? FormatNumber(mean, 1) : FormatCount(std::llround(mean));
  };
  std::string rows =
      TableRow("td", {"<b>triangulated</b>", per_frame(points), "cells and corners of the cloud"});
  for (const auto& [reason, count] : reasons) {
    rows += TableRow("td", {EscapeHtml(Words(reason)), per_frame(count), Explanation(reason)});
  }
  if (unclaimed > 0) {
    rows += TableRow("td", {"not on the garment", per_frame(unclaimed),
                            "points whose cell belongs to no vertex of the template"});
  }
  return Section("cells", "Cells that were seen", Table({"", "Per frame", ""}, rows, "reasons"));
}

std::string GarmentSection(const JobSummary& summary) {
  if (summary.garments.empty()) return "";
  std::string rows;
  for (const GarmentSummary& garment : summary.garments)
    rows += TableRow(
        "td", {EscapeHtml(garment.id), FormatCount(garment.vertices), FormatPercent(garment.Coverage()),
               FormatPercent(garment.lowest_coverage), EscapeHtml(garment.lowest_coverage_frame),
               FormatNumber(MedianOf(garment.sigmas_mm), 3)});
  std::string about = "<p><code>weft split</code> makes a result of each garment by itself.";
  for (const auto& [pair, frames] : summary.overlaps)
    absl::StrAppend(&about, " ", EscapeHtml(pair.second), " lies over ", EscapeHtml(pair.first), " in ",
                    Counted(frames, "frame", "frames"), ".");
  return Section(
      "garments", "Garments",
      about + "</p>\n" +
          Table({"Garment", "Vertices", "Cells observed", "Lowest", "in frame", "Median sigma, mm"}, rows,
                "garments"));
}

std::string AlignmentSection(const std::vector<v1::FrameReport>& frames) {
  const std::vector<StageSummary> stages = SummarizeStages(frames);
  if (stages.empty()) return "";
  std::string rows;
  for (const StageSummary& stage : stages) {
    const auto [least, most] = std::ranges::minmax_element(stage.iterations);
    const std::string range = *least == *most ? "" : absl::StrFormat(" (%.0f to %.0f)", *least, *most);
    rows += TableRow(
        "td",
        {EscapeHtml(Words(stage.name)), FormatCount(static_cast<int64_t>(stage.iterations.size())),
         absl::StrFormat("%.0f%s", MedianOf(stage.iterations), range), EnergyText(MedianOf(stage.before)),
         EnergyText(MedianOf(stage.after)), FormatDuration(MedianOf(stage.time_ms))});
  }
  const std::string medians = frames.size() > 1 ? "<p>Medians over the frames.</p>\n" : "";
  return Section("alignment", "Alignment",
                 medians + Table({"Stage", "Frames", "Iterations", "Energy before", "Energy after", "Time"},
                                 rows, "stages"));
}

std::string ScanSection(const std::vector<v1::FrameReport>& frames) {
  constexpr int kLongTable = 40;
  std::string rows;
  int64_t points = 0, found = 0, vertices = 0;
  int scans = 0;
  for (const v1::FrameReport& frame : frames) {
    if (!frame.mesh().has_scan()) continue;
    const v1::ScanReport& scan = frame.mesh().scan();
    ++scans, points += scan.points(), found += scan.found(), vertices += scan.vertices();
    rows += TableRow("td", {NameHtml(frame.frame()), FormatCount(scan.points()), FormatCount(scan.found()),
                            scan.found() > 0 ? FormatNumber(scan.median_distance_mm(), 2) : kDash,
                            FormatCount(scan.vertices()), FormatCount(scan.unmeasured()),
                            FormatCount(scan.without_normal()), scan.normals_turned() ? "turned" : ""});
  }
  if (scans == 0) return "";
  const std::string about =
      absl::StrCat("<p>", FormatCount(found), " of ", FormatCount(points), " points found the cloth in ",
                   Counted(scans, "frame", "frames"), "; ", FormatCount(vertices),
                   " vertices without a target follow them.</p>\n");
  const std::string table =
      Table({"Frame", "Points", "Found a vertex", "Distance, mm", "Vertices that follow",
             "Without measurement", "Without normal", "Normals"},
            rows, "scans");
  return Section("scans", "Scans",
                 about + (scans > kLongTable
                              ? absl::StrCat("<details><summary>All scans</summary>\n", table, "</details>\n")
                              : table));
}

}  // namespace weft
