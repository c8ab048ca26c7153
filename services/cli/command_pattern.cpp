// weft pattern: boards, before they are printed.
#include <cstdio>
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"
#include "pattern/board/board_generation.h"
#include "pattern/board/coding_report.h"
#include "services/cli/coding_report_text.h"
#include "services/cli/commands.h"
#include "services/cli/progress.h"
#include "services/files/atomic_file.h"
#include "services/files/board_file.h"

namespace weft {
namespace {

struct GenerateOptions {
  BoardGenerationOptions board;
  std::string panels;
  std::string out;
  bool json = false;
};

absl::Status Generate(const GenerateOptions& options) {
  BoardGenerationOptions made = options.board;
  if (!options.panels.empty()) {
    absl::StatusOr<std::vector<uint8_t>> panels = ReadPanelMask(options.panels, made.rows, made.cols);
    if (!panels.ok()) return panels.status();
    made.panels = *std::move(panels);
  }
  absl::StatusOr<Board> board;
  {
    Progress progress("generate", 100, ProgressVisible(false), ProgressUnit::kPercent);
    board = GenerateBoard(made, [&](double share) {
      progress.Set(static_cast<uint64_t>(100 * share), 100);
      return true;
    });
  }
  if (!board.ok()) return board.status();
  const std::string provenance = absl::StrCat("weft pattern generate, seed ", made.seed);
  if (absl::Status status = WriteBoard(options.out, *board, provenance); !status.ok()) return status;
  if (options.json) {
    const absl::StatusOr<std::string> written = ReadWholeFile(options.out + "/board.json");
    if (!written.ok()) return written.status();
    std::fputs(written->c_str(), stdout);
    return absl::OkStatus();
  }
  std::printf("%s/board.json: %d rows, %d columns, cells of %g mm (%.0f x %.0f mm), hash %s\n",
              options.out.c_str(), board->rows, board->cols, board->cell_mm, board->cols * board->cell_mm,
              board->rows * board->cell_mm, board->ContentHash().c_str());
  return absl::OkStatus();
}

struct BoardCheckOptions {
  std::string board;
  size_t limit = 20;
  bool compare = false;
  CodingReportOptions report;
  bool json = false;
};

void PrintCheck(const BoardCheckOptions& options, const Board& board, const CodingReport& report,
                const CodingReport* random, const std::vector<CodeClash>& clashes) {
  std::printf("%s: %d rows, %d columns, hash %s\n", options.board.c_str(), board.rows, board.cols,
              board.ContentHash().c_str());
  std::printf("%s", CodingReportText(board, report, random).c_str());
  for (const CodeClash& c : clashes) {
    std::printf(
        "clash: the 3x3 window at row %d, column %d reads as the one at row %d, column %d (%d degrees)\n",
        c.row_a, c.col_a, c.row_b, c.col_b, 90 * c.quarter_turns);
  }
  if (clashes.empty())
    std::printf("every 3x3 window %sis unique under rotation\n", board.panels.empty() ? "" : "of a panel ");
}

absl::Status CheckBoard(const BoardCheckOptions& options) {
  const absl::StatusOr<Board> board = ReadBoard(options.board);
  if (!board.ok()) return board.status();
  const std::vector<CodeClash> clashes = board->FindClashes(options.limit);
  const absl::StatusOr<CodingReport> report = MakeCodingReport(*board, options.report);
  if (!report.ok()) return report.status();
  std::optional<CodingReport> random;
  if (options.compare) {
    const absl::StatusOr<Board> other =
        GenerateBoard(board->rows, board->cols, board->cell_mm, options.report.seed);
    if (!other.ok()) return other.status();
    const absl::StatusOr<CodingReport> its = MakeCodingReport(*other, options.report);
    if (!its.ok()) return its.status();
    random = *its;
  }
  const CodingReport* shown = random ? &*random : nullptr;
  if (options.json) {
    std::printf("%s\n", CodingReportJson(*board, *report, shown, clashes).c_str());
  } else {
    PrintCheck(options, *board, *report, shown, clashes);
  }
  if (clashes.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(options.board, ": ", clashes.size(), clashes.size() == options.limit ? " or more" : "",
                   " pairs of 3x3 windows read the same; their cells are ambiguous"));
}

void AddGenerate(CLI::App& pattern, CommandLine& line) {
  CLI::App* generate = AddCommand(
      pattern, "generate",
      "Make a board whose 3x3 windows are unique under rotation, and hard to mistake for each other: "
      "DIR/board.json and DIR/board.png (one pixel per cell). The same seed makes the same board.",
      "  weft pattern generate --rows 300 --cols 900 --cell-mm 2.7 --seed 1 --out shirt_board\n"
      "  weft pattern generate --rows 1200 --cols 1200 --panels panels.png --out big_board");
  auto options = std::make_shared<GenerateOptions>();
  generate->add_option("--rows", options->board.rows, "Rows of cells")->required()->type_name("N");
  generate->add_option("--cols", options->board.cols, "Columns of cells")->required()->type_name("N");
  generate->add_option("--cell-mm", options->board.cell_mm, "Pitch of the cells on the cloth")
      ->type_name("MM")
      ->check(CLI::PositiveNumber);
  generate
      ->add_option("--square-fraction", options->board.square_fraction,
                   "Coloured part of the pitch, the rest is ink line")
      ->type_name("SHARE")
      ->check(CLI::Range(0.3, 1.0));
  generate
      ->add_option(
          "--panels", options->panels,
          "Image with one pixel per cell, black outside of the garment's panels: only windows within "
          "one panel are made unique")
      ->type_name("MASK");
  generate->add_option("--seed", options->board.seed, "Seed of the search")->type_name("N");
  generate->add_option("--out", options->out, "Folder to write to")->required()->type_name("DIR");
  generate->add_flag("--json", options->json, "Print board.json (weft.v1.Board)");
  generate->callback([options, &line] { line.run = [options] { return Generate(*options); }; });
}

void AddCheck(CLI::App& pattern, CommandLine& line) {
  CLI::App* check = AddCommand(
      pattern, "check",
      "Check that every 3x3 window of a board is unique under rotation, and show how distinct its windows "
      "are: odds that wrong, unread or mirrored colours read as other windows, and how far the "
      "nearest other window is. Exit status 2 when windows clash.",
      "  weft pattern check board.png\n  weft pattern check shirt_board/board.json --compare\n"
      "  weft pattern check shirt_board --json");
  auto options = std::make_shared<BoardCheckOptions>();
  check->add_option("BOARD", options->board, "board.json, or an image with one pixel per cell")
      ->required()
      ->type_name("");
  check->add_option("--limit", options->limit, "The most clashes to list")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  check
      ->add_option("--samples", options->report.samples,
                   "Windows per size whose nearest other one is searched for")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  check->add_flag("--compare", options->compare, "Show a random board of this size beside it");
  check->add_flag("--json", options->json, "Print JSON");
  check->callback([options, &line] { line.run = [options] { return CheckBoard(*options); }; });
}

}  // namespace

void AddPatternCommand(CLI::App& app, CommandLine& line) {
  CLI::App* pattern =
      AddCommand(app, "pattern", "Make, check and print boards, the printed pattern of the cloth", "");
  pattern->require_subcommand(1);
  AddGenerate(*pattern, line);
  AddCheck(*pattern, line);
  AddPatternPrintCommand(*pattern, line);
  AddPatternPaletteCommand(*pattern, line);
}

}  // namespace weft
