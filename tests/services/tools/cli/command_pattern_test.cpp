// weft pattern generate, check, join.
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

using ::testing::AllOf;
using ::testing::HasSubstr;

class CommandPattern : public ::testing::Test {
 protected:
  CommandRun Pattern(std::vector<std::string> words) const {
    words.insert(words.begin(), "pattern");
    return RunCommand(AddPatternCommand, std::move(words));
  }
  CommandRun Generate(const std::string& seed, std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"generate",       "--rows", "12",     "--cols", "10",
                                      "--cell-mm",      "2.5",    "--seed", seed,     "--out",
                                      folder_ / "board"};
    words.insert(words.end(), more.begin(), more.end());
    return Pattern(words);
  }

  const TempFolder folder_;
};

TEST_F(CommandPattern, ABoardIsWrittenAsItsOptionsSay) {
  const CommandRun run = Generate("3", {"--square-fraction", "0.8"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const auto board = ReadBoard(folder_ / "board");
  ASSERT_TRUE(board.ok()) << board.status();
  EXPECT_EQ(board->rows, 12);
  EXPECT_EQ(board->cols, 10);
  EXPECT_EQ(board->cell_mm, 2.5);
  EXPECT_EQ(board->square_fraction, 0.8);
  EXPECT_TRUE(board->FindClashes(1).empty());
  EXPECT_EQ(run.out, folder_ / "board" +
                         std::string("/board.json: 12 rows, 10 columns, cells of 2.5 mm (25 x 30 "
                                     "mm), hash ") +
                         board->ContentHash() + "\n");
  EXPECT_THAT(ReadBytes(folder_ / "board/board.json"), HasSubstr("weft pattern generate, seed 3"));
}

// The fabric of a board that is gone cannot be read any more.
TEST_F(CommandPattern, ABoardIsReplacedByItselfOrByForce) {
  ASSERT_TRUE(Generate("3").status.ok());
  const std::string hash = ReadBoard(folder_ / "board")->ContentHash();
  EXPECT_TRUE(Generate("3").status.ok());
  // The colours of another pitch are the same, and the fabric is not.
  EXPECT_EQ(Pattern({"generate", "--rows", "12", "--cols", "10", "--cell-mm", "3", "--seed", "3", "--out",
                     folder_ / "board"})
                .status.code(),
            absl::StatusCode::kAlreadyExists);
  const CommandRun refused = Generate("4");
  EXPECT_EQ(refused.status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("a board, whose fabric may be sewn"), HasSubstr("--force")));
  EXPECT_EQ(ReadBoard(folder_ / "board")->ContentHash(), hash);
  ASSERT_TRUE(Generate("4", {"--force"}).status.ok());
  EXPECT_NE(ReadBoard(folder_ / "board")->ContentHash(), hash);
}

TEST_F(CommandPattern, CheckNamesAFewOfManyClashes) {
  Board board = *GenerateBoard(12, 12, 2.7, 1);
  for (size_t i = 0; i < board.cells.size(); ++i)  // every second cell alike: all windows read as others
    board.cells[i] = static_cast<CellColor>((i / 12 + i % 12) % 2);
  board.id = "clashing";
  ASSERT_TRUE(WriteBoard(folder_ / "board", board).ok());
  const CommandRun run = Pattern({"check", folder_ / "board", "--limit", "2"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(run.message(), HasSubstr(": 2 or more pairs of 3x3 windows read the same"));
  size_t lines = 0;
  for (size_t at = run.out.find("clash: "); at != std::string::npos; at = run.out.find("clash: ", at + 1))
    ++lines;
  EXPECT_EQ(lines, 2u);
}

TEST_F(CommandPattern, CheckComparesWithARandomBoardOnRequest) {
  ASSERT_TRUE(Generate("3").status.ok());
  const CommandRun alone = Pattern({"check", folder_ / "board"});
  ASSERT_TRUE(alone.status.ok()) << alone.status;
  EXPECT_THAT(alone.out, HasSubstr("every 3x3 window is unique under rotation\n"));
  EXPECT_EQ(alone.out.find("random board"), std::string::npos);
  const CommandRun compared = Pattern({"check", folder_ / "board", "--compare"});
  ASSERT_TRUE(compared.status.ok()) << compared.status;
  EXPECT_THAT(compared.out, HasSubstr("random board"));
}

TEST_F(CommandPattern, BoardsThatShareWindowsAreNotJoined) {
  ASSERT_TRUE(Generate("3").status.ok());
  const CommandRun run = Pattern({"join", folder_ / "board", folder_ / "board", "--out", folder_ / "both"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "both"));
}

// A picture of white cells, with black ones in the column 5.
std::string MaskOfTwoPanels(const TempFolder& folder) {
  auto pixels = std::make_shared<std::vector<uint8_t>>(12 * 10, uint8_t{255});
  for (size_t row = 0; row < 12; ++row) (*pixels)[10 * row + 5] = 0;
  Frame mask;
  mask.width_px = 10, mask.height_px = 12, mask.format = PixelFormat::kGrey8;
  mask.pixels = std::move(pixels);
  EXPECT_TRUE(WriteImageFile(folder / "mask.png", mask).ok());
  return folder / "mask.png";
}

TEST_F(CommandPattern, PanelsAreCheckedByThemselves) {
  ASSERT_TRUE(Generate("3", {"--panels", MaskOfTwoPanels(folder_)}).status.ok());
  EXPECT_FALSE(ReadBoard(folder_ / "board")->panels.empty());
  const CommandRun run = Pattern({"check", folder_ / "board"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, testing::StartsWith((folder_ / "board") + ": 12 rows, 10 columns, hash " +
                                           ReadBoard(folder_ / "board")->ContentHash() + "\ncolours: "));
  // Two panels of 10 x 3 and 10 x 2 windows.
  EXPECT_THAT(run.out, HasSubstr("\n3x3 windows                                     50\n"));
  EXPECT_THAT(run.out, testing::EndsWith("\nevery 3x3 window of a panel is unique under rotation\n"));
  EXPECT_EQ(Generate("3", {"--panels", folder_ / "none.png"}).status.code(), absl::StatusCode::kNotFound);
}

TEST_F(CommandPattern, BoardsThatAreMadeApartAreCheckedTogether) {
  ASSERT_TRUE(Generate("3").status.ok());
  const std::string other = folder_ / "other";
  const CommandRun made = Pattern({"generate", "--rows", "9", "--cols", "10", "--cell-mm", "2.5", "--seed",
                                   "4", "--apart-from", folder_ / "board", "--out", other, "--json"});
  ASSERT_TRUE(made.status.ok()) << made.status;
  EXPECT_EQ(made.out, ReadBytes(other + "/board.json"));
  const CommandRun run = Pattern({"check", folder_ / "board", other, "--samples", "5"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, testing::StartsWith((folder_ / "board") + " and " + other + ": "));
  EXPECT_THAT(run.out,
              testing::EndsWith("\nevery 3x3 window is unique under rotation over all boards: garments of "
                                "them may be filmed together\n"));
  Board clashing = *ReadBoard(other);
  const Board first = *ReadBoard(folder_ / "board");
  for (int i = 0; i < 9; ++i)
    clashing.cells[static_cast<size_t>(10 * (i / 3) + 5 + i % 3)] = first.at(i / 3, i % 3);
  clashing.id = "clashing";
  ASSERT_TRUE(WriteBoard(folder_ / "clashing", clashing).ok());
  const CommandRun same = Pattern({"check", folder_ / "board", folder_ / "clashing", "--limit", "1"});
  EXPECT_EQ(same.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(same.out, HasSubstr("clash: the 3x3 window at row 0, column 0 of " + (folder_ / "board") +
                                  " reads as the one at row 0, column 5 of " + (folder_ / "clashing") +
                                  " (0 degrees)\n"));
  EXPECT_EQ(same.message(),
            (folder_ / "board") + " and " + (folder_ / "clashing") +
                ": 1 or more pairs of 3x3 windows read the same; their cells are ambiguous where both "
                "boards are seen; print one that was made with `weft pattern generate --apart-from` "
                "the other");
}

TEST_F(CommandPattern, AClashIsToldWithItsTurn) {
  Board board = *GenerateBoard(12, 12, 2.7, 1);
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col)
      board.cells[static_cast<size_t>((row + 6) * 12 + col + 6)] =
          board.at(2 - col, row);  // turned by 90 degrees
  ASSERT_TRUE(WriteBoard(folder_ / "board", board).ok());
  const CommandRun run = Pattern({"check", folder_ / "board"});
  EXPECT_THAT(run.out,
              testing::ContainsRegex("clash: the 3x3 window at row 0, column 0 reads as the one at row 6, "
                                     "column 6 .(90|270) degrees.\n"));
  EXPECT_THAT(run.message(),
              testing::EndsWith(": 1 pairs of 3x3 windows read the same; their cells are ambiguous"));
  const CommandRun json = Pattern({"check", folder_ / "board", "--json"});
  EXPECT_EQ(json.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(json.out, HasSubstr("\"unique\": false"));
}

}  // namespace
}  // namespace weft
