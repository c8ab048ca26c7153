// The sections about the job as a whole.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "services/formats/files/json_file.h"
#include "services/formats/options/option_range.h"
#include "services/formats/options/presets.h"
#include "services/results/report/html_text.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/verdict_html.h"
#include "weft/v1/take.pb.h"

namespace weft {
namespace {

std::string Tile(absl::string_view label, const std::string& value, const std::string& detail) {
  return absl::StrCat("<div class=\"tile\"><span>", label, "</span><b>", value, "</b><small>", detail,
                      "</small></div>");
}

std::string CameraTile(const JobSummary& summary) {
  int with_images = 0;
  for (const CameraSummary& camera : summary.cameras) with_images += camera.frames_missing == 0;
  const size_t unknown = summary.facts.unknown.size();
  return Tile("Cameras",
              absl::StrCat(FormatCount(with_images), " of ",
                           FormatCount(static_cast<int64_t>(summary.cameras.size() + unknown))),
              unknown == 0
                  ? "gave an image in every frame"
                  : absl::StrCat("were used in every frame; ", FormatCount(static_cast<int64_t>(unknown)),
                                 unknown == 1 ? " is" : " are", " not in the rig"));
}

std::string TimeTile(const JobSummary& summary) {
  return Tile("Time", FormatDuration(summary.median_frame_ms),
              std::isfinite(summary.wall_ms)
                  ? absl::StrCat("per frame, median; ", FormatDuration(summary.wall_ms), " in all")
                  : "per frame, median");
}

std::string DrivenTiles(const JobSummary& summary) {
  return Tile("Rays", FormatCount(std::llround(summary.median_rays)),
              "cells seen by a camera that the mesh follows, per frame, median") +
         Tile("Residual", FormatNumber(summary.median_residual_px, 2) + "\xC2\xA0px",
              "from the mesh to these cells, median") +
         Tile("Uncertainty", FormatNumber(summary.median_sigma_mm, 2) + "\xC2\xA0mm",
              "sigma of all vertices, median") +
         TimeTile(summary);
}

std::string Tiles(const JobSummary& summary) {
  std::string tiles = summary.is_driven ? DrivenTiles(summary) : "";
  if (std::isfinite(summary.coverage)) {
    tiles += Tile("Cells observed", FormatPercent(summary.coverage),
                  summary.registered > 1
                      ? absl::StrCat("lowest ", FormatPercent(summary.lowest_coverage), " in frame ",
                                     NameHtml(Shortened(summary.lowest_coverage_frame, 24)))
                      : "of those that the template has");
    tiles += Tile("Triangulated cells", FormatCount(std::llround(summary.median_cells)), "per frame, median");
    tiles += Tile("Uncertainty", FormatNumber(summary.median_sigma_mm, 3) + "\xC2\xA0mm",
                  "sigma of observed vertices, median");
    tiles += TimeTile(summary);
  }
  if (!summary.cameras.empty()) tiles += CameraTile(summary);
  if (summary.peak_memory_mib > 0) {
    tiles += Tile("Memory", FormatCount(std::llround(summary.peak_memory_mib)) + "\xC2\xA0MiB",
                  "largest of a worker");
  }
  return tiles.empty() ? "" : absl::StrCat("<div class=\"tiles\">", tiles, "</div>\n");
}

std::string FactRow(absl::string_view name, const std::string& html, const std::string& hash = "") {
  return TableRow("td", {std::string(name), html,
                         hash.empty() ? "" : absl::StrCat("<code>", EscapeHtml(hash), "</code>")});
}

std::string FrameRange(const v1::RegistrationSpec& spec) {
  if (!spec.frames().empty()) return EscapeHtml(spec.frames());
  if (spec.first_frame() == 0 && spec.end_frame() == 0) return "all frames of the dump";
  if (spec.end_frame() == 0) return absl::StrCat("from position ", spec.first_frame(), " to the end");
  return absl::StrCat("positions ", spec.first_frame(), " to ", spec.end_frame() - 1, " of the dump");
}

std::string Threads(const std::vector<v1::FrameReport>& frames) {
  std::set<int> threads;
  for (const v1::FrameReport& frame : frames) {
    if (frame.threads() > 0) threads.insert(frame.threads());
  }
  return threads.empty() ? "\xE2\x80\x93" : absl::StrCat(absl::StrJoin(threads, ", "), " per frame");
}

// "decode 1, align 2", of all frames.
std::string Algorithms(const std::vector<v1::FrameReport>& frames) {
  std::vector<std::string> versions;
  for (const v1::FrameReport& frame : frames)
    for (const v1::StageKey& key : frame.keys()) {
      if (key.version() == 0) continue;
      std::string version = absl::StrCat(Words(key.stage()), " ", key.version());
      if (std::ranges::find(versions, version) == versions.end()) versions.push_back(std::move(version));
    }
  return versions.empty() ? kDash : EscapeHtml(absl::StrJoin(versions, ", "));
}

// What the take is called on the set, where the dump is a take and says so.
std::string TakeRows(const std::string& dump) {
  v1::Take take;
  if (!ReadJsonFile(dump + "/take.json", take).ok()) return "";
  std::string rows;
  const std::pair<const char*, const std::string*> facts[] = {{"Slate", &take.slate()},
                                                              {"Take", &take.name()},
                                                              {"Notes", &take.notes()},
                                                              {"Timecode", &take.timecode()}};
  for (const auto& [name, text] : facts)
    if (!text->empty()) rows += FactRow(name, EscapeHtml(*text));
  return rows;
}

// Inputs and options of work without fields of its own.
std::string WorkRows(const v1::Job& job) {
  const v1::WorkSpec& work = job.spec().work();
  std::string rows;
  for (const v1::NamedValue& input : work.inputs()) {
    const auto hash = std::find_if(job.inputs().work().begin(), job.inputs().work().end(),
                                   [&input](const auto& one) { return one.name() == input.name(); });
    rows += FactRow(EscapeHtml(input.name()), NameHtml(input.value()),
                    hash == job.inputs().work().end() ? "" : EscapeHtml(hash->value()));
  }
  for (const v1::NamedValue& option : work.options())
    rows += FactRow(EscapeHtml(option.name()), option.value().empty() ? "yes" : EscapeHtml(option.value()));
  return rows;
}

}  // namespace

std::string Section(const std::string& id, const std::string& heading, const std::string& body) {
  return absl::StrCat("<section id=\"", id, "\">\n<h2>", heading, "</h2>\n", body, "</section>\n");
}

std::string TableRow(const std::string& cell_tag, const std::vector<std::string>& cells) {
  std::string row = "<tr>";
  for (const std::string& cell : cells) absl::StrAppend(&row, "<", cell_tag, ">", cell, "</", cell_tag, ">");
  return row + "</tr>\n";
}

std::string Table(const std::vector<std::string>& header, const std::string& rows,
                  const std::string& classes) {
  return absl::StrCat("<div class=\"scroll\"><table class=\"", classes, "\">\n",
                      header.empty() ? "" : absl::StrCat("<thead>", TableRow("th", header), "</thead>\n"),
                      "<tbody>\n", rows, "</tbody></table></div>\n");
}

std::string HeadSection(const v1::Job& job, const JobSummary& summary) {
  const v1::Verdict& verdict = job.verdict();
  std::string more;
  for (const std::string& remark : Remarks(job, summary))
    if (remark != verdict.reason()) absl::StrAppend(&more, "<li>", EscapeHtml(remark), "</li>\n");
  if (!more.empty()) more = absl::StrCat("<ul class=\"remarks\">\n", more, "</ul>\n");
  const bool is_over = verdict.grade() != v1::GRADE_UNSPECIFIED;
  const std::string of_work =
      job.spec().has_work() ? absl::StrCat("Weft report: ", EscapeHtml(job.spec().work().kind())) : "";
  const std::string kind = absl::StrCat(!of_work.empty()   ? of_work
                                        : job.has_driven() ? "Weft driving report"
                                                           : "Weft registration report",
                                        is_over ? "" : " <span class=\"badge\">&#8230; not finished</span>");
  return PageHead(kind, Headline(job, summary), verdict, more + Tiles(summary));
}

std::string WarningSection(const v1::Job& job, const std::vector<std::string>& notes) {
  constexpr size_t kShown = 50;
  std::vector<std::string> warnings(job.warnings().begin(), job.warnings().end());
  warnings.insert(warnings.end(), notes.begin(), notes.end());
  if (warnings.empty()) return "";
  std::string body = "<ul class=\"warnings\">\n";
  for (size_t i = 0; i < warnings.size() && i < kShown; ++i) {
    absl::StrAppend(&body, "<li>", EscapeHtml(warnings[i]), "</li>\n");
  }
  if (warnings.size() > kShown) absl::StrAppend(&body, "<li>and ", warnings.size() - kShown, " more</li>\n");
  return Section("warnings", "Warnings", body + "</ul>\n");
}

// What differs from the preset, and all options folded away.
std::string OptionSection(const v1::Job& job) {
  const v1::RegistrationOptions& options = job.spec().options();
  const absl::StatusOr<v1::PipelineOptions> preset = PresetOptions(options.preset());
  if (!preset.ok()) return "";
  std::string rows, all;
  int options_of_job = 0;
  for (const OptionField& option : AllOptions()) {
    const std::string value = OptionValue(options.pipeline(), option), usual = OptionValue(*preset, option);
    if (value.empty() || option.IsGroup()) continue;
    const std::string name = absl::StrCat("<code>", EscapeHtml(option.path), "</code>"),
                      meaning = EscapeHtml(option.About().text());
    ++options_of_job;
    all += TableRow("td", {name, EscapeHtml(value), meaning});
    if (value != usual) rows += TableRow("td", {name, EscapeHtml(value), EscapeHtml(usual), meaning});
  }
  if (options_of_job == 0) return "";
  const std::string differing =
      rows.empty()
          ? absl::StrCat("<p>All are those of the preset ",
                         EscapeHtml(options.preset().empty() ? kDefaultPreset : options.preset()), ".</p>\n")
          : absl::StrCat("<h3>Different from the preset</h3>\n",
                         Table({"Option", "Value", "Preset", "Meaning"}, rows, "facts"));
  return Section("options", "Options",
                 absl::StrCat(differing, "<details><summary>All ", options_of_job, " options</summary>\n",
                              Table({"Option", "Value", "Meaning"}, all, "facts"), "</details>\n"));
}

std::string InputSection(const v1::Job& job, const std::vector<v1::FrameReport>& frames) {
  const v1::RegistrationSpec& spec = job.spec();
  std::string rows;
  if (spec.has_work()) {
    rows += WorkRows(job);
  } else {
    rows += FactRow("Dump", NameHtml(spec.dump()));
    rows += TakeRows(spec.dump());
    rows += FactRow("Rig", NameHtml(spec.rig()), job.inputs().rig());
    rows += FactRow("Board", NameHtml(spec.board()), job.inputs().board());
    rows += FactRow("Template", NameHtml(spec.garment()), job.inputs().garment());
  }
  rows += FactRow("Results", NameHtml(spec.out()));
  rows += FactRow("Frames", FrameRange(spec));
  if (!spec.has_work()) rows += FactRow("Preset", EscapeHtml(spec.options().preset()));
  rows += FactRow("Job", NameHtml(job.id().empty() ? "local" : job.id()));
  rows += FactRow("Submitted", FormatUnixTime(job.created_unix_ns()));
  rows += FactRow("Started", FormatUnixTime(job.started_unix_ns()));
  rows += FactRow("Finished", FormatUnixTime(job.finished_unix_ns()));
  rows += FactRow("Threads", Threads(frames));
  rows +=
      FactRow("Weft", EscapeHtml(job.weft_version().empty() ? "version not recorded" : job.weft_version()));
  rows += FactRow("Algorithms", Algorithms(frames));
  return Section("inputs", "Inputs, versions and ids", Table({"", "", "Content hash"}, rows, "facts"));
}

}  // namespace weft
