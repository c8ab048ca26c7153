#include "pattern/board/coding_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

namespace weft {
namespace {

// Squares of the board as strings, under all rotations, by plain indices.
std::vector<std::string> Readings(const Board& board, int row, int col, int size) {
  std::vector<std::string> turned(4);
  const auto digit = [&](int r, int c) {
    return static_cast<char>('0' + static_cast<int>(board.at(row + r, col + c)));
  };
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      turned[0] += digit(i, j);
      turned[1] += digit(size - 1 - j, i);
      turned[2] += digit(size - 1 - i, size - 1 - j);
      turned[3] += digit(j, size - 1 - i);
    }
  }
  return turned;
}

int Differing(const std::string& a, const std::string& b) {
  int count = 0;
  for (size_t i = 0; i < a.size(); ++i) count += a[i] != b[i];
  return count;
}

// The nearest other reading of every window, sorted.
std::vector<int> NearestOfAll(const Board& board, int size) {
  std::vector<std::vector<std::string>> windows;
  for (int r = 0; r + size <= board.rows; ++r)
    for (int c = 0; c + size <= board.cols; ++c) windows.push_back(Readings(board, r, c, size));
  std::vector<int> nearest;
  for (size_t a = 0; a < windows.size(); ++a) {
    int least = size * size;
    for (size_t b = 0; b < windows.size(); ++b)
      for (int turn = 0; turn < 4; ++turn)
        if (a != b || turn != 0) least = std::min(least, Differing(windows[a][0], windows[b][turn]));
    nearest.push_back(least);
  }
  std::sort(nearest.begin(), nearest.end());
  return nearest;
}

TEST(CodingReport, AgreesWithComparingAllWindows) {
  const Board board = *GenerateBoard(24, 19, 2.7, 3);
  const auto report = MakeCodingReport(board, {100000, 1});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->windows, 22 * 17);
  std::set<std::string> valid;
  for (int r = 0; r + 3 <= board.rows; ++r)
    for (int c = 0; c + 3 <= board.cols; ++c)
      for (const std::string& reading : Readings(board, r, c, 3)) valid.insert(reading);
  int64_t aliases = 0, one_away = 0, mirrored = 0, ambiguous = 0;
  for (int r = 0; r + 3 <= board.rows; ++r) {
    for (int c = 0; c + 3 <= board.cols; ++c) {
      const std::string own = Readings(board, r, c, 3)[0];
      std::string mirror = own;
      for (int i = 0; i < 3; ++i) std::swap(mirror[3 * i], mirror[3 * i + 2]);
      mirrored += valid.count(mirror);
      int here = 0;
      for (int cell = 0; cell < 9; ++cell) {
        int of_cell = 0;
        for (char color = '0'; color < '7'; ++color) {
          std::string other = own;
          other[cell] = color;
          of_cell += other != own && valid.count(other) > 0;
        }
        ambiguous += of_cell > 0;
        here += of_cell;
      }
      aliases += here;
      one_away += here > 0;
    }
  }
  EXPECT_EQ(report->mirrored, mirrored);
  EXPECT_EQ(report->one_away, one_away);
  EXPECT_NEAR(report->alias_odds, static_cast<double>(aliases) / (54.0 * 22 * 17), 1e-12);
  EXPECT_NEAR(report->erasure_odds, static_cast<double>(ambiguous) / (9.0 * 22 * 17), 1e-12);
  for (const WindowDistances& d : report->distances) {
    const std::vector<int> nearest = NearestOfAll(board, d.size);
    EXPECT_EQ(d.samples, static_cast<int>(nearest.size()));
    EXPECT_EQ(d.least, nearest.front());
    for (int k = 0; k <= d.size * d.size; ++k)
      EXPECT_EQ(d.count[k], std::count(nearest.begin(), nearest.end(), k)) << d.size << " at " << k;
  }
}

TEST(CodingReport, CountsColorsAndEqualNeighbors) {
  Board board;
  board.rows = 3;
  board.cols = 4;
  board.cells.assign(12, CellColor::kRed);
  board.cells[5] = CellColor::kBlue;
  const auto report = MakeCodingReport(board, {});
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->colors[0], 11);
  EXPECT_EQ(report->colors[3], 1);
  EXPECT_EQ(report->equal_neighbors, 17 - 4);
  EXPECT_NEAR(report->equal_diagonal_share, 8.0 / 12, 1e-12);
}

TEST(CodingReport, CountsWindowsOfPanelsOnly) {
  Board board = *GenerateBoard(20, 20, 2.7, 3);
  board.panels.assign(400, 0);
  for (int r = 2; r < 8; ++r)
    for (int c = 3; c < 12; ++c) board.panels[20 * r + c] = c < 8 ? 1 : 2;
  const auto report = MakeCodingReport(board, {});
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->windows, 4 * 3 + 4 * 2);
  EXPECT_EQ(report->distances[2].samples, 2);  // 5x5: two in the first panel, none in the second
}

}  // namespace
}  // namespace weft
