// weft pattern print.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "capture/image/image_file.h"
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

TEST_F(CommandPatternPrint, PanelsComeByThemselvesUnlessTheWholeIsAskedFor) {
  auto pixels = std::make_shared<std::vector<uint8_t>>(12 * 10, uint8_t{255});
  for (size_t row = 0; row < 12; ++row) (*pixels)[10 * row + 5] = 0;
  Frame mask;
  mask.width_px = 10, mask.height_px = 12, mask.format = PixelFormat::kGrey8;
  mask.pixels = std::move(pixels);
  ASSERT_TRUE(WriteImageFile(folder_ / "mask.png", mask).ok());
  const CommandRun panels = Print({"--out", folder_ / "a.svg", "--panels", folder_ / "mask.png"});
  ASSERT_TRUE(panels.status.ok()) << panels.status;
  EXPECT_EQ(panels.out,
            (folder_ / "a.svg") +
                ": 1 page, cells of 5 mm, ink lines of 1 mm\npage 1: 1500 x 200 mm\n  panel 1\n  panel 2\n");
  const CommandRun json = Print({"--out", folder_ / "b.svg", "--panels", folder_ / "mask.png", "--json"});
  EXPECT_THAT(
      json.out,
      HasSubstr("\"pages\": [{\"width_mm\": 1500.000, \"height_mm\": 200.000, \"pieces\": [{\"panel\": 1, "));
  EXPECT_THAT(json.out, HasSubstr("}, {\"panel\": 2, "));
  const CommandRun whole = Print({"--out", folder_ / "c.svg", "--panels", folder_ / "mask.png", "--whole"});
  EXPECT_EQ(whole.out,
            (folder_ / "c.svg") +
                ": 1 page, cells of 5 mm, ink lines of 1 mm\npage 1: 330 x 180 mm\n  tile 1.1: rows 0 to 11, "
                "columns 0 to 9\n");
}

TEST_F(CommandPatternPrint, ManyPagesAreManyFiles) {
  const std::vector<std::string> words = {"--out", folder_ / "a.svg", "--cell-mm",
                                          "60",    "--page-width-mm", "400"};
  const CommandRun run = Print(words);
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, testing::EndsWith(" ...: 3 pages, cells of 60 mm, ink lines of 12 mm\n"
                                         "page 1: 358 x 840 mm\n  tile 1.1: rows 0 to 11, columns 0 to 4\n"
                                         "page 2: 358 x 840 mm\n  tile 1.2: rows 0 to 11, columns 4 to 8\n"
                                         "page 3: 330 x 840 mm\n  tile 1.3: rows 0 to 11, columns 8 to 9\n"));
  std::vector<std::string> json = words;
  json.push_back("--json");
  const std::string told = Print(json).out;
  EXPECT_THAT(told, HasSubstr("\", \""));
  EXPECT_THAT(told, HasSubstr("}]}, {\"width_mm\": 358.000"));
}

}  // namespace
}  // namespace weft
