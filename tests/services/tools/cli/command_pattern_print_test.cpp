// weft pattern print.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/formats/files/board_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class CommandPatternPrint : public ::testing::Test {
 protected:
  CommandPatternPrint() {
    Board board = *GenerateBoard(12, 10, 5, 1);
    board.square_fraction = 0.8;
    EXPECT_TRUE(WriteBoard(folder_ / "board", board).ok());
  }
  CommandRun Print(std::vector<std::string> words) const {
    words.insert(words.begin(), {"print", folder_ / "board"});
    return RunCommand(AddPatternPrintCommand, std::move(words));
  }

  const TempFolder folder_;
};

TEST_F(CommandPatternPrint, TellsAProgramWhereThePiecesLie) {
  const std::string file = folder_ / "board.svg";
  const CommandRun run = Print({"--out", file, "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_TRUE(std::filesystem::exists(file));
  // 0.2 of 5 mm is ink.
  EXPECT_THAT(run.out,
              HasSubstr("{\"cell_mm\": 5, \"ink_line_mm\": 1, \"files\": [\"" + file + "\"], \"pages\": ["));
  EXPECT_THAT(run.out, HasSubstr("\"row\": 0, \"col\": 0, \"rows\": 12, \"cols\": 10}]}]}\n"));
}

TEST_F(CommandPatternPrint, CellsAndLinesMayBeOthersThanTheBoards) {
  const CommandRun run = Print({"--out", folder_ / "a.svg", "--cell-mm", "8", "--ink-line-mm", "0.5"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("a.svg: 1 page, cells of 8 mm, ink lines of 0.5 mm\n"));
}

TEST_F(CommandPatternPrint, ABoardWiderThanTheFabricComesInTiles) {
  // 10 cells of 60 mm on pages of 400 mm.
  const CommandRun run =
      Print({"--out", folder_ / "a.svg", "--cell-mm", "60", "--page-width-mm", "400", "--overlap-mm", "60"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("cells of 60 mm"));
  size_t pieces = 0;  // a line each, below that of their page
  for (size_t at = run.out.find("\n  "); at != std::string::npos; at = run.out.find("\n  ", at + 1)) ++pieces;
  EXPECT_GE(pieces, 2u);
  EXPECT_EQ(run.out.find(": 1 page,") == std::string::npos, std::filesystem::exists(folder_ / "a-2.svg"));
}

TEST_F(CommandPatternPrint, NamesTheEndingsAndRefusesAMaskOfAnotherSize) {
  const CommandRun ending = Print({"--out", folder_ / "board.doc"});
  EXPECT_EQ(ending.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(ending.message(), HasSubstr(".pdf, .svg or .tif"));
  ASSERT_TRUE(WriteBoard(folder_ / "other", *GenerateBoard(9, 9, 5, 2)).ok());
  EXPECT_EQ(Print({"--out", folder_ / "a.svg", "--panels", folder_ / "other/board.png"}).status.code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.svg"));
}

}  // namespace
}  // namespace weft
