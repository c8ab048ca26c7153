#include "pattern/board/board_generation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "pattern/board/board_index.h"
#include "pattern/board/coding_report.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

BoardGenerationOptions Sized(int rows, int cols, uint64_t seed = 1) {
  BoardGenerationOptions options;
  options.rows = rows;
  options.cols = cols;
  options.seed = seed;
  return options;
}

Board GeneratedBy(const BoardGenerationOptions& options) {
  auto board = GenerateBoard(options);
  EXPECT_TRUE(board.ok()) << board.status();
  return *std::move(board);
}

// A window and its three rotations by plain indices.
std::set<std::string> ReadingsAt(const Board& board, int row, int col) {
  std::string turned[4];
  const auto digit = [&](int r, int c) {
    return static_cast<char>('0' + static_cast<int>(board.at(row + r, col + c)));
  };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      turned[0] += digit(i, j);
      turned[1] += digit(2 - j, i);
      turned[2] += digit(2 - i, 2 - j);
      turned[3] += digit(j, 2 - i);
    }
  }
  return {turned, turned + 4};
}

int EqualNeighbors(const Board& board) {
  int equal = 0;
  for (int r = 0; r < board.rows; ++r) {
    for (int c = 0; c < board.cols; ++c) {
      equal += r > 0 && board.at(r, c) == board.at(r - 1, c);
      equal += c > 0 && board.at(r, c) == board.at(r, c - 1);
    }
  }
  return equal;
}

TEST(BoardGeneration, MakesUniqueWindowsWithoutEqualNeighbors) {
  const Board board = GeneratedBy(Sized(60, 90));
  EXPECT_EQ(EqualNeighbors(board), 0);
  std::set<std::string> seen;
  for (int r = 0; r + 3 <= board.rows; ++r) {
    for (int c = 0; c + 3 <= board.cols; ++c) {
      const std::set<std::string> readings = ReadingsAt(board, r, c);
      EXPECT_EQ(readings.size(), 4u);  // none equals its own rotation
      for (const std::string& reading : readings) EXPECT_TRUE(seen.insert(reading).second);
    }
  }
}

TEST(BoardGeneration, DependsOnItsOptionsOnly) {
  EXPECT_EQ(GeneratedBy(Sized(40, 30, 5)).cells, GeneratedBy(Sized(40, 30, 5)).cells);
  EXPECT_NE(GeneratedBy(Sized(40, 30, 5)).cells, GeneratedBy(Sized(40, 30, 6)).cells);
}

TEST(BoardGeneration, BeatsARandomBoard) {
  const Board board = GeneratedBy(Sized(300, 900));
  const auto random = GenerateBoard(300, 900, 2.7, 1);
  ASSERT_TRUE(random.ok());
  EXPECT_EQ(EqualNeighbors(board), 0);
  EXPECT_TRUE(board.FindClashes(1).empty());
  const auto ours = MakeCodingReport(board, {200, 3}), theirs = MakeCodingReport(*random, {200, 3});
  ASSERT_TRUE(ours.ok() && theirs.ok());
  EXPECT_LT(ours->alias_odds, 0.65 * theirs->alias_odds);
  EXPECT_LT(ours->erasure_odds, 0.8 * theirs->erasure_odds);
  EXPECT_LT(ours->mirrored, theirs->mirrored / 100);
  for (size_t k = 0; k < 3; ++k) EXPECT_GE(ours->distances[k].mean, theirs->distances[k].mean - 0.05);
  for (const int64_t count : ours->colors) EXPECT_NEAR(count, 300 * 900 / 7.0, 300 * 900 / 700.0);
}

TEST(BoardGeneration, FillsAThousandByAThousand) {
  const Board board = GeneratedBy(Sized(1000, 1000));
  EXPECT_EQ(EqualNeighbors(board), 0);
  EXPECT_TRUE(board.FindClashes(1).empty());
}

TEST(BoardGeneration, WindowsNeedBeUniqueInsidePanelsOnly) {
  // Panels on a sixth of a board that has more windows than there are codes.
  BoardGenerationOptions options = Sized(1300, 1300);
  options.panels.assign(1300 * 1300, 0);
  for (int r = 0; r < 1300; ++r)
    for (int c = 0; c < 1300; ++c)
      if (r % 500 < 400 && c % 650 < 200)
        options.panels[r * 1300 + c] = static_cast<uint8_t>(1 + r / 500 + 3 * (c / 650));
  const Board board = GeneratedBy(options);
  EXPECT_EQ(EqualNeighbors(board), 0);
  EXPECT_TRUE(board.FindClashes(1).empty());
  Board without = board;
  without.panels.clear();
  EXPECT_FALSE(without.FindClashes(1).empty());
  const auto index = BoardIndex::Build(board);
  ASSERT_TRUE(index.ok()) << index.status();
  EXPECT_EQ(index->Find(BoardWindow(board, 520, 660)), (BoardPose{520, 660, 0}));
}

TEST(BoardGeneration, SaysWhatIsWrong) {
  EXPECT_EQ(GenerateBoard(Sized(2, 30)).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(GenerateBoard(Sized(1400, 1400)).status().message(), HasSubstr("only 1616170 exist"));
  BoardGenerationOptions options = Sized(20, 20);
  options.panels.assign(7, 1);
  EXPECT_THAT(GenerateBoard(options).status().message(), HasSubstr("panels has 7 entries"));
  options.panels.assign(400, 0);
  EXPECT_THAT(GenerateBoard(options).status().message(), HasSubstr("no cell that belongs to a panel"));
}

TEST(BoardGeneration, TellsItsProgressAndStopsWhenAsked) {
  double last = 0;
  const auto stopped = GenerateBoard(Sized(200, 300), [&](double share) {
    EXPECT_GT(share, last);
    last = share;
    return share < 0.5;
  });
  EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled);
  EXPECT_NEAR(last, 0.5, 0.1);
}

}  // namespace
}  // namespace weft
