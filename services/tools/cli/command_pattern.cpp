// weft pattern: boards, before they are printed.
#include <cstdio>
#include <filesystem>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "pattern/board/board_generation.h"
#include "pattern/board/coding_report.h"
#include "pattern/board/joint_board.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/board_file.h"
#include "services/tools/cli/coding_report_text.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/output_guard.h"
#include "services/tools/cli/progress.h"

namespace weft {
namespace {

struct GenerateOptions {
  BoardGenerationOptions board;
  std::string panels;
  std::vector<std::string> apart_from;
  std::string out;
  bool json = false;
  OutputGuard guard;
};

// The fabric of a board that is gone can no longer be read.
absl::Status MayWriteBoard(const std::string& folder, const Board& board, const OutputGuard& guard) {
  const std::string file = (std::filesystem::path(folder) / "board.json").string();
  const absl::StatusOr<Board> before = ReadBoard(file);
  const bool is_same = before.ok() && before->ContentHash() == board.ContentHash() &&
                       before->cell_mm == board.cell_mm;  // the hash is of the colours alone
  if (is_same) return absl::OkStatus();
  return guard.MayReplace(file, "a board, whose fabric may be sewn");
}

absl::Status Generate(const GenerateOptions& options) {
  BoardGenerationOptions made = options.board;
  if (!options.panels.empty()) {
    WEFT_ASSIGN_OR_RETURN(made.panels, ReadPanelMask(options.panels, made.rows, made.cols));
  }
  for (const std::string& path : options.apart_from) {
    WEFT_ASSIGN_OR_RETURN(Board other, ReadBoard(path));
    made.apart_from.push_back(std::move(other));
  }
  absl::StatusOr<Board> board = WithShareBar("generate", false, 0, [&](const auto& tell) {
    return GenerateBoard(made, [&tell](double share) {
      tell(share);
      return true;
    });
  });
  if (!board.ok()) return board.status();
  WEFT_RETURN_IF_ERROR(MayWriteBoard(options.out, *board, options.guard));
  const std::string provenance = absl::StrCat("weft pattern generate, seed ", made.seed);
  WEFT_RETURN_IF_ERROR(WriteBoard(options.out, *board, provenance));
  if (options.json) {
    WEFT_ASSIGN_OR_RETURN(const std::string written, ReadWholeFile(options.out + "/board.json"));
    std::fputs(written.c_str(), stdout);
    return absl::OkStatus();
  }
  std::printf("%s/board.json: %d rows, %d columns, cells of %g mm (%.0f x %.0f mm), hash %s\n",
              options.out.c_str(), board->rows, board->cols, board->cell_mm, board->cols * board->cell_mm,
              board->rows * board->cell_mm, board->ContentHash().c_str());
  return absl::OkStatus();
}

struct BoardCheckOptions {
  std::vector<std::string> boards;
  size_t limit = 20;
  bool compare = false;
  CodingReportOptions report;
  bool json = false;
};

// Where a window is: on which of several boards, and where there.
std::string PlaceText(const BoardCheckOptions& options, const Board& board, int row, int col) {
  const int part = options.boards.size() > 1 ? board.PartAt(row) : -1;
  if (part < 0) return absl::StrCat("row ", row, ", column ", col);
  return absl::StrCat("row ", row - board.parts[part].first_row, ", column ", col, " of ",
                      options.boards[part]);
}

void PrintCheck(const BoardCheckOptions& options, const Board& board, const CodingReport& report,
                const CodingReport* random, const std::vector<CodeClash>& clashes) {
  std::printf("%s: %d rows, %d columns, hash %s\n", absl::StrJoin(options.boards, " and ").c_str(),
              board.rows, board.cols, board.ContentHash().c_str());
  std::printf("%s", CodingReportText(board, report, random).c_str());
  for (const CodeClash& c : clashes) {
    std::printf("clash: the 3x3 window at %s reads as the one at %s (%d degrees)\n",
                PlaceText(options, board, c.row_a, c.col_a).c_str(),
                PlaceText(options, board, c.row_b, c.col_b).c_str(), 90 * c.quarter_turns);
  }
  if (!clashes.empty()) return;
  std::printf("every 3x3 window %sis unique under rotation%s\n",
              board.panels.empty() || options.boards.size() > 1 ? "" : "of a panel ",
              options.boards.size() > 1 ? " over all boards: garments of them may be filmed together" : "");
}

absl::StatusOr<Board> ReadBoards(const std::vector<std::string>& paths) {
  if (paths.size() == 1) return ReadBoard(paths[0]);
  std::vector<Board> boards;
  for (const std::string& path : paths) {
    WEFT_ASSIGN_OR_RETURN(Board board, ReadBoard(path));
    boards.push_back(std::move(board));
  }
  return JoinBoards(boards);
}

absl::Status CheckBoard(const BoardCheckOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoards(options.boards));
  const std::vector<CodeClash> clashes = board.FindClashes(options.limit);
  WEFT_ASSIGN_OR_RETURN(const CodingReport report, MakeCodingReport(board, options.report));
  std::optional<CodingReport> random;
  if (options.compare) {
    WEFT_ASSIGN_OR_RETURN(const Board other,
                          GenerateBoard(board.rows, board.cols, board.cell_mm, options.report.seed));
    WEFT_ASSIGN_OR_RETURN(random, MakeCodingReport(other, options.report));
  }
  const CodingReport* shown = random ? &*random : nullptr;
  if (options.json) {
    std::printf("%s\n", CodingReportJson(board, report, shown, clashes).c_str());
  } else {
    PrintCheck(options, board, report, shown, clashes);
  }
  if (clashes.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(absl::StrJoin(options.boards, " and "), ": ", clashes.size(),
                   clashes.size() == options.limit ? " or more" : "",
                   " pairs of 3x3 windows read the same; their cells are ambiguous",
                   options.boards.size() > 1 ? " where both boards are seen; print one that was made with "
                                               "`weft pattern generate --apart-from` the other"
                                             : ""));
}

struct JoinOptions {
  std::vector<std::string> boards;
  std::string out;
  OutputGuard guard;
};

absl::Status Join(const JoinOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const Board joint, ReadBoards(options.boards));
  const std::vector<CodeClash> clashes = joint.FindClashes(1);
  if (!clashes.empty())
    return absl::InvalidArgumentError(
        absl::StrCat(absl::StrJoin(options.boards, " and "),
                     ": 3x3 windows of one read as windows of the other; `weft pattern check` lists them, "
                     "`weft pattern generate --apart-from` makes boards that share none"));
  WEFT_RETURN_IF_ERROR(MayWriteBoard(options.out, joint, options.guard));
  const std::string provenance = "weft pattern join";
  WEFT_RETURN_IF_ERROR(WriteBoard(options.out, joint, provenance));
  std::printf("%s/board.json: %d rows, %d columns, hash %s\n", options.out.c_str(), joint.rows, joint.cols,
              joint.ContentHash().c_str());
  for (size_t i = 0; i < joint.parts.size(); ++i) {
    const BoardPart& part = joint.parts[i];
    std::printf("  rows %d to %d: %s\n", part.first_row, part.first_row + part.rows - 1,
                options.boards[i].c_str());
  }
  return absl::OkStatus();
}

void AddGenerate(CLI::App& pattern, CommandLine& line) {
  const auto [generate, options] = AddCommand<GenerateOptions>(
      pattern, line, Generate, "generate",
      "Make a board whose 3x3 windows are unique under rotation, and hard to mistake for each other: "
      "DIR/board.json and DIR/board.png (one pixel per cell). The same seed makes the same board.",
      "  weft pattern generate --rows 300 --cols 900 --cell-mm 2.7 --seed 1 --out shirt_board\n"
      "  weft pattern generate --rows 1200 --cols 1200 --panels panels.png --out big_board\n"
      "  weft pattern generate --rows 200 --cols 300 --apart-from shirt_board --out skirt_board");
  AddRequired(*generate, "--rows N", options->board.rows, "Rows of cells");
  AddRequired(*generate, "--cols N", options->board.cols, "Columns of cells");
  AddOption(*generate, "--cell-mm MM", options->board.cell_mm, "Pitch of the cells on the cloth",
            CLI::PositiveNumber);
  AddOption(*generate, "--square-fraction SHARE", options->board.square_fraction,
            "Coloured part of the pitch, the rest is ink line", CLI::Range(0.3, 1.0));
  AddOption(*generate, "--panels MASK", options->panels,
            "Image with one pixel per cell, black outside of the garment's panels: only windows within one "
            "panel are made unique");
  AddOption(*generate, "--apart-from BOARD", options->apart_from,
            "Boards of garments that may be filmed together with this one: no window reads as one of theirs");
  AddOption(*generate, "--seed N", options->board.seed, "Seed of the search");
  AddRequired(*generate, "--out DIR", options->out, "Folder to write to");
  options->guard.AddTo(*generate);
  generate->add_flag("--json", options->json, "Print board.json (weft.v1.Board)");
}

void AddCheck(CLI::App& pattern, CommandLine& line) {
  const auto [check, options] = AddCommand<BoardCheckOptions>(
      pattern, line, CheckBoard, "check",
      "Check that every 3x3 window of a board is unique under rotation, and show how distinct its windows "
      "are: odds that wrong, unread or mirrored colours read as other windows, and how far the nearest other "
      "window is. Several boards are checked against each other, too: garments of them can only be filmed "
      "together where no window reads as one of another board. Exit status 2 when windows clash.",
      "  weft pattern check board.png\n  weft pattern check shirt_board/board.json --compare\n"
      "  weft pattern check shirt_board --json\n  weft pattern check shirt_board skirt_board");
  AddRequired(*check, "BOARD", options->boards,
              "board.json, or an image with one pixel per cell; one or more");
  AddOption(*check, "--limit N", options->limit, "The most clashes to list", CLI::PositiveNumber);
  AddOption(*check, "--samples N", options->report.samples,
            "Windows per size whose nearest other one is searched for", CLI::PositiveNumber);
  check->add_flag("--compare", options->compare, "Show a random board of this size beside it");
  check->add_flag("--json", options->json, "Print JSON");
}

void AddJoin(CLI::App& pattern, CommandLine& line) {
  const auto [join, options] = AddCommand<JoinOptions>(
      pattern, line, Join, "join",
      "Make one board of the boards of several garments, so that a take that shows them together is decoded "
      "in one pass: DIR/board.json and its images. `weft template join` does the same for their templates.",
      "  weft pattern join shirt_board skirt_board --out outfit_board");
  AddRequired(*join, "BOARD", options->boards, "Two boards or more, in their order from top to bottom");
  AddRequired(*join, "--out DIR", options->out, "Folder to write to");
  options->guard.AddTo(*join);
}

}  // namespace

void AddPatternCommand(CLI::App& app, CommandLine& line) {
  CLI::App* pattern =
      AddGroup(app, "pattern", "Make, check and print boards, the printed pattern of the cloth");
  AddGenerate(*pattern, line);
  AddCheck(*pattern, line);
  AddJoin(*pattern, line);
  AddPatternPrintCommand(*pattern, line);
  AddPatternPaletteCommand(*pattern, line);
}

}  // namespace weft
