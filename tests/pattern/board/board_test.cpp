#include "pattern/board/board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "pattern/board/board_index.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

Board Generated(int rows, int cols, uint64_t seed = 1) {
  auto board = GenerateBoard(rows, cols, 3.0, seed);
  EXPECT_TRUE(board.ok()) << board.status();
  return *std::move(board);
}

// All readings of all windows, by plain comparison of strings.
std::multiset<std::string> AllReadings(const Board& board) {
  std::multiset<std::string> readings;
  for (int row = 0; row + 3 <= board.rows; ++row) {
    for (int col = 0; col + 3 <= board.cols; ++col) {
      std::string turned[4];
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          const auto digit = [&](int r, int c) {
            return static_cast<char>('0' + static_cast<int>(board.at(row + r, col + c)));
          };
          turned[0] += digit(i, j);
          turned[1] += digit(2 - j, i);
          turned[2] += digit(2 - i, 2 - j);
          turned[3] += digit(j, 2 - i);
        }
      }
      readings.insert(turned, turned + 4);
    }
  }
  return readings;
}

TEST(Board, SurvivesItsImage) {
  Board board = Generated(12, 17);
  const auto again = BoardFromImage(BoardToImage(board));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->rows, 12);
  EXPECT_EQ(again->cols, 17);
  EXPECT_EQ(again->cells, board.cells);
  EXPECT_EQ(again->ContentHash(), board.ContentHash());
}

TEST(Board, ReadsColoursThatWereCompressed) {
  const Board board = Generated(5, 5);
  Frame image = BoardToImage(board);
  auto pixels = *image.pixels;
  for (size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = pixels[i] > 128 ? pixels[i] - i % 50 : pixels[i] + i % 50;
  }
  image.pixels = std::make_shared<std::vector<uint8_t>>(pixels);
  const auto again = BoardFromImage(image);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->cells, board.cells);
}

TEST(Board, NamesTheFirstPixelThatIsNoColour) {
  Frame image = BoardToImage(Generated(5, 6));
  auto pixels = *image.pixels;
  for (int c = 0; c < 3; ++c) pixels[3 * (2 * 6 + 4) + c] = 0;
  image.pixels = std::make_shared<std::vector<uint8_t>>(pixels);
  const auto board = BoardFromImage(image);
  EXPECT_EQ(board.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(board.status().message(), HasSubstr("x=4 y=2"));
}

TEST(Board, RefusesGreyImages) {
  Frame image;
  image.width_px = image.height_px = 4;
  image.pixels = std::make_shared<std::vector<uint8_t>>(16, 255);
  EXPECT_EQ(BoardFromImage(image).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Board, ValidateNamesTheField) {
  Board board = Generated(5, 5);
  board.cells.pop_back();
  EXPECT_THAT(board.Validate().message(), HasSubstr("cells"));
  board = Generated(5, 5);
  board.rows = 2;
  EXPECT_THAT(board.Validate().message(), HasSubstr("rows"));
  board = Generated(5, 5);
  board.cells[7] = static_cast<CellColor>(9);
  EXPECT_THAT(board.Validate().message(), HasSubstr("cells[7]"));
}

TEST(Board, HashDependsOnSizeAndColours) {
  Board board = Generated(5, 8);
  Board other = board;
  other.id = "another name";
  other.cell_mm = 7;
  EXPECT_EQ(board.ContentHash(), other.ContentHash());
  std::swap(other.rows, other.cols);
  EXPECT_NE(board.ContentHash(), other.ContentHash());
  other = board;
  other.cells[3] = other.cells[3] == CellColor::kRed ? CellColor::kBlue : CellColor::kRed;
  EXPECT_NE(board.ContentHash(), other.ContentHash());
}

TEST(Board, FindsWindowsThatReadTheSameAfterAQuarterTurn) {
  Board board = Generated(12, 12);
  ASSERT_TRUE(board.FindClashes(10).empty());
  // The window at (0, 0), turned once, overwrites the one at (8, 8).
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) board.cells[(8 + i) * 12 + 8 + j] = board.at(j, 2 - i);
  }
  bool found = false;
  for (const CodeClash& c : board.FindClashes(100)) {
    found |= c.row_a == 0 && c.col_a == 0 && c.row_b == 8 && c.col_b == 8 && c.quarter_turns % 2 == 1;
  }
  EXPECT_TRUE(found);
  EXPECT_THAT(BoardIndex::Build(board).status().message(), HasSubstr("read the same"));
}

TEST(Board, FindsWindowThatEqualsItsOwnRotation) {
  Board board = Generated(4, 4);
  for (int i = 0; i < 9; ++i) {
    board.cells[(i / 3) * 4 + i % 3] = i % 2 ? CellColor::kRed : CellColor::kBlue;
  }
  const auto clashes = board.FindClashes(10);
  ASSERT_FALSE(clashes.empty());
  EXPECT_EQ(clashes[0].row_a, clashes[0].row_b);
  EXPECT_NE(clashes[0].quarter_turns, 0);
}

TEST(Board, StopsAtTheLimitOfClashes) {
  Board board;
  board.rows = board.cols = 20;
  board.cells.assign(400, CellColor::kCyan);
  EXPECT_EQ(board.FindClashes(7).size(), 7u);
}

TEST(GenerateBoard, MakesUniqueWindowsWithoutEqualNeighbours) {
  const Board board = Generated(40, 70);
  for (int row = 0; row < 40; ++row) {
    for (int col = 0; col < 70; ++col) {
      if (col > 0) {
        EXPECT_NE(board.at(row, col), board.at(row, col - 1));
      }
      if (row > 0) {
        EXPECT_NE(board.at(row, col), board.at(row - 1, col));
      }
    }
  }
  const auto readings = AllReadings(board);
  EXPECT_EQ(std::set<std::string>(readings.begin(), readings.end()).size(), size_t{38 * 68 * 4});
  EXPECT_EQ(readings.size(), size_t{38 * 68 * 4});
}

TEST(GenerateBoard, MakesABoardForAWholeShirt) {
  const Board board = Generated(300, 900);
  EXPECT_TRUE(board.FindClashes(1).empty());
  EXPECT_DOUBLE_EQ(board.cell_mm, 3.0);
}

TEST(GenerateBoard, DependsOnTheSeedOnly) {
  EXPECT_EQ(Generated(30, 30, 5).cells, Generated(30, 30, 5).cells);
  EXPECT_NE(Generated(30, 30, 5).cells, Generated(30, 30, 6).cells);
}

TEST(GenerateBoard, SaysWhenThereIsNoSuchBoard) {
  EXPECT_EQ(GenerateBoard(4000, 4000, 3, 1).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(GenerateBoard(2, 9, 3, 1).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(GenerateBoard(1 << 30, 1 << 30, 3, 1).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(BoardIndex, FindsEveryWindowUnderEveryRotation) {
  const Board board = Generated(20, 30);
  const auto index = BoardIndex::Build(board);
  ASSERT_TRUE(index.ok()) << index.status();
  for (int row = 3; row < 16; ++row) {
    for (int col = 3; col < 26; ++col) {
      for (int turn = 0; turn < 4; ++turn) {
        const BoardPose pose{row, col, turn};
        Window seen;
        for (int i = 0; i < 9; ++i) {
          const BoardCell cell = pose.ToBoard(i / 3, i % 3);
          seen[i] = board.at(cell.row, cell.col);
        }
        const auto found = index->Find(seen);
        ASSERT_TRUE(found.has_value());
        EXPECT_EQ(*found, pose);
      }
    }
  }
}

TEST(BoardIndex, FindsNothingForForeignWindows) {
  const auto index = BoardIndex::Build(Generated(10, 10));
  ASSERT_TRUE(index.ok());
  EXPECT_FALSE(index->FindCode(0).has_value());
}

}  // namespace
}  // namespace weft
