// weft pattern: boards, before they are printed.
#include <array>
#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "pattern/board.h"
#include "services/cli/commands.h"
#include "services/files/board_file.h"

namespace weft {
namespace {

struct GenerateOptions {
  int rows = 0;
  int cols = 0;
  double cell_mm = 2.7;
  uint64_t seed = 1;
  std::string out;
};

absl::Status Generate(const GenerateOptions& options) {
  const absl::StatusOr<Board> board =
      GenerateBoard(options.rows, options.cols, options.cell_mm, options.seed);
  if (!board.ok()) return board.status();
  const std::string provenance = absl::StrCat("weft pattern generate, seed ", options.seed);
  if (absl::Status status = WriteBoard(options.out, *board, provenance); !status.ok()) return status;
  std::printf("%s/board.json: %d rows, %d columns, cells of %g mm (%.0f x %.0f mm), hash %s\n",
              options.out.c_str(), board->rows, board->cols, board->cell_mm, board->cols * board->cell_mm,
              board->rows * board->cell_mm, board->ContentHash().c_str());
  return absl::OkStatus();
}

struct CheckOptions {
  std::string board;
  size_t limit = 20;
  bool json = false;
};

struct Balance {
  std::array<size_t, kCellColors> count{};
  size_t equal_neighbours = 0;  // pairs of 4-neighbours of one colour: the ink line alone parts them
};

Balance ColorBalance(const Board& board) {
  Balance balance;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      const CellColor color = board.at(row, col);
      ++balance.count[static_cast<int>(color)];
      balance.equal_neighbours += board.Contains(row, col + 1) && board.at(row, col + 1) == color;
      balance.equal_neighbours += board.Contains(row + 1, col) && board.at(row + 1, col) == color;
    }
  }
  return balance;
}

std::string CheckJson(const Board& board, const std::vector<CodeClash>& clashes, const Balance& balance) {
  std::string out = absl::StrFormat(
      "{\"rows\": %d, \"cols\": %d, \"hash\": \"%s\", \"unique\": %s, \"equal_neighbours\": %d, \"colors\": "
      "{",
      board.rows, board.cols, board.ContentHash(), clashes.empty() ? "true" : "false",
      balance.equal_neighbours);
  for (int i = 0; i < kCellColors; ++i) {
    absl::StrAppendFormat(&out, "%s\"%s\": %d", i ? ", " : "",
                          std::string(CellColorName(static_cast<CellColor>(i))), balance.count[i]);
  }
  out += "}, \"clashes\": [";
  for (size_t i = 0; i < clashes.size(); ++i) {
    const CodeClash& c = clashes[i];
    absl::StrAppendFormat(
        &out, "%s{\"row_a\": %d, \"col_a\": %d, \"row_b\": %d, \"col_b\": %d, \"quarter_turns\": %d}",
        i ? ", " : "", c.row_a, c.col_a, c.row_b, c.col_b, c.quarter_turns);
  }
  return out + "]}";
}

void PrintCheck(const CheckOptions& options, const Board& board, const std::vector<CodeClash>& clashes,
                const Balance& balance) {
  std::printf("%s: %d rows, %d columns, hash %s\n", options.board.c_str(), board.rows, board.cols,
              board.ContentHash().c_str());
  std::printf("colours:");
  for (int i = 0; i < kCellColors; ++i) {
    const double percent =
        100.0 * static_cast<double>(balance.count[i]) / static_cast<double>(board.cells.size());
    std::printf("%s %s %.1f %%", i ? "," : "", std::string(CellColorName(static_cast<CellColor>(i))).c_str(),
                percent);
  }
  std::printf("\nneighbours of equal colour: %zu pairs\n", balance.equal_neighbours);
  for (const CodeClash& c : clashes) {
    std::printf(
        "clash: the 3x3 window at row %d, column %d reads as the one at row %d, column %d (%d degrees)\n",
        c.row_a, c.col_a, c.row_b, c.col_b, 90 * c.quarter_turns);
  }
  if (clashes.empty()) std::printf("every 3x3 window is unique under rotation\n");
}

absl::Status Check(const CheckOptions& options) {
  const absl::StatusOr<Board> board = ReadBoard(options.board);
  if (!board.ok()) return board.status();
  const std::vector<CodeClash> clashes = board->FindClashes(options.limit);
  const Balance balance = ColorBalance(*board);
  if (options.json) {
    std::printf("%s\n", CheckJson(*board, clashes, balance).c_str());
  } else {
    PrintCheck(options, *board, clashes, balance);
  }
  if (clashes.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(options.board, ": ", clashes.size(), clashes.size() == options.limit ? " or more" : "",
                   " pairs of 3x3 windows read the same; cells there cannot be told apart"));
}

void AddGenerate(CLI::App& pattern, CommandLine& line) {
  CLI::App* generate =
      AddCommand(pattern, "generate",
                 "Make a random board whose 3x3 windows are unique under rotation: DIR/board.json and "
                 "DIR/board.png (one "
                 "pixel per cell). The same seed makes the same board.",
                 "  weft pattern generate --rows 300 --cols 900 --cell-mm 2.7 --seed 1 --out shirt_board");
  auto options = std::make_shared<GenerateOptions>();
  generate->add_option("--rows", options->rows, "Rows of cells")->required()->type_name("N");
  generate->add_option("--cols", options->cols, "Columns of cells")->required()->type_name("N");
  generate->add_option("--cell-mm", options->cell_mm, "Pitch of the cells on the cloth")
      ->type_name("MM")
      ->check(CLI::PositiveNumber);
  generate->add_option("--seed", options->seed, "Seed of the search")->type_name("N");
  generate->add_option("--out", options->out, "Folder to write to")->required()->type_name("DIR");
  generate->callback([options, &line] { line.run = [options] { return Generate(*options); }; });
}

void AddCheck(CLI::App& pattern, CommandLine& line) {
  CLI::App* check =
      AddCommand(pattern, "check",
                 "Check that every 3x3 window of a board is unique under rotation, and show its balance of "
                 "colours. Exit "
                 "status 2 when windows clash.",
                 "  weft pattern check board.png\n  weft pattern check shirt_board/board.json --json");
  auto options = std::make_shared<CheckOptions>();
  check->add_option("BOARD", options->board, "board.json, or an image with one pixel per cell")
      ->required()
      ->type_name("");
  check->add_option("--limit", options->limit, "The most clashes to list")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  check->add_flag("--json", options->json, "Print JSON");
  check->callback([options, &line] { line.run = [options] { return Check(*options); }; });
}

}  // namespace

void AddPatternCommand(CLI::App& app, CommandLine& line) {
  CLI::App* pattern =
      AddCommand(app, "pattern", "Make and check boards, the printed pattern of the cloth", "");
  pattern->require_subcommand(1);
  AddGenerate(*pattern, line);
  AddCheck(*pattern, line);
}

}  // namespace weft
