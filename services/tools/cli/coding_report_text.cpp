#include "services/tools/cli/coding_report_text.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace weft {
namespace {

double Percent(int64_t part, int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

struct Line {
  std::string what;
  std::string value;
};

std::vector<Line> LinesOf(const CodingReport& report) {
  std::vector<Line> lines = {
      {"3x3 windows", absl::StrCat(report.windows)},
      {"one wrong colour reads as another window", absl::StrFormat("%.2f %%", 100 * report.alias_odds)},
      {"windows with another one wrong colour away",
       absl::StrFormat("%.1f %%", Percent(report.one_away, report.windows))},
      {"one cell unread: more than one window fits", absl::StrFormat("%.1f %%", 100 * report.erasure_odds)},
      {"windows that read as another in a mirror",
       absl::StrFormat("%.2f %% (%d)", Percent(report.mirrored, report.windows), report.mirrored)},
      {"equal diagonal neighbours", absl::StrFormat("%.1f %%", 100 * report.equal_diagonal_share)}};
  for (const WindowDistances& d : report.distances) {
    size_t most = d.count.size() - 1;
    while (most > 0 && d.count[most] == 0) --most;
    lines.push_back({absl::StrFormat("nearest other %dx%d window, cells that differ", d.size, d.size),
                     d.samples > 0 ? absl::StrFormat("%d to %d, mean %.2f", d.least, most, d.mean) : "-"});
  }
  return lines;
}

std::string ReportFields(const CodingReport& report) {
  std::string out = absl::StrFormat(
      "\"windows\": %d, \"alias_odds\": %.6f, \"one_away_share\": %.6f, \"erasure_odds\": %.6f, "
      "\"mirrored_windows\": %d, \"equal_diagonal_share\": %.6f, \"nearest\": [",
      report.windows, report.alias_odds, Percent(report.one_away, report.windows) / 100, report.erasure_odds,
      report.mirrored, report.equal_diagonal_share);
  for (size_t i = 0; i < report.distances.size(); ++i) {
    const WindowDistances& d = report.distances[i];
    absl::StrAppendFormat(
        &out, "%s{\"size\": %d, \"samples\": %d, \"least\": %d, \"mean\": %.4f, \"by_distance\": [",
        i ? ", " : "", d.size, d.samples, d.least, d.mean);
    for (size_t k = 0; k < d.count.size(); ++k) absl::StrAppend(&out, k ? ", " : "", d.count[k]);
    out += "]}";
  }
  return out + "]";
}

}  // namespace

std::string CodingReportText(const Board& board, const CodingReport& report, const CodingReport* random) {
  std::string out = "colours:";
  for (int i = 0; i < kCellColors; ++i) {
    absl::StrAppendFormat(&out, "%s %s %.1f %%", i ? "," : "",
                          std::string(CellColorName(static_cast<CellColor>(i))),
                          Percent(report.colors[i], static_cast<int64_t>(board.cells.size())));
  }
  absl::StrAppendFormat(&out, "\nneighbours of equal colour: %d pairs\n", report.equal_neighbors);
  const std::vector<Line> lines = LinesOf(report);
  const std::vector<Line> others = random != nullptr ? LinesOf(*random) : std::vector<Line>();
  if (random != nullptr) absl::StrAppendFormat(&out, "%-48s%-24s%s\n", "", "this board", "random board");
  for (size_t i = 0; i < lines.size(); ++i) {
    absl::StrAppendFormat(&out, "%-48s%-24s", lines[i].what, lines[i].value);
    while (out.back() == ' ' && others.empty()) out.pop_back();
    absl::StrAppend(&out, others.empty() ? "" : others[i].value, "\n");
  }
  return out;
}

std::string CodingReportJson(const Board& board, const CodingReport& report, const CodingReport* random,
                             const std::vector<CodeClash>& clashes) {
  std::string out = absl::StrFormat(
      "{\"rows\": %d, \"cols\": %d, \"hash\": \"%s\", \"unique\": %s, \"equal_neighbours\": %d, \"colors\": "
      "{",
      board.rows, board.cols, board.ContentHash(), clashes.empty() ? "true" : "false",
      report.equal_neighbors);
  for (int i = 0; i < kCellColors; ++i) {
    absl::StrAppendFormat(&out, "%s\"%s\": %d", i ? ", " : "",
                          std::string(CellColorName(static_cast<CellColor>(i))), report.colors[i]);
  }
  out += "}, " + ReportFields(report);
  if (random != nullptr) out += ", \"random\": {" + ReportFields(*random) + "}";
  out += ", \"clashes\": [";
  for (size_t i = 0; i < clashes.size(); ++i) {
    const CodeClash& c = clashes[i];
    absl::StrAppendFormat(
        &out, "%s{\"row_a\": %d, \"col_a\": %d, \"row_b\": %d, \"col_b\": %d, \"quarter_turns\": %d}",
        i ? ", " : "", c.row_a, c.col_a, c.row_b, c.col_b, c.quarter_turns);
  }
  return out + "]}";
}

}  // namespace weft
