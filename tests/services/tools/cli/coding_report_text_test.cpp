#include "services/tools/cli/coding_report_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Of twelve cells.
Board SmallBoard() {
  Board board;
  board.rows = 3;
  board.cols = 4;
  board.cells.assign(12, CellColor::kRed);
  return board;
}

CodingReport SmallReport() {
  CodingReport report;
  report.windows = 200;
  report.mirrored = 3;
  report.one_away = 50;
  report.alias_odds = 0.0123;
  report.erasure_odds = 0.456;
  report.colors = {3, 2, 2, 2, 1, 1, 1};
  report.equal_neighbors = 5;
  report.equal_diagonal_share = 0.25;
  report.distances = {
      {.size = 3, .samples = 10, .least = 2, .mean = 3.5, .count = {0, 0, 1, 4, 3, 1, 1, 0, 0, 0}},
      {.size = 4, .samples = 0, .least = 0, .mean = 0, .count = std::vector<int>(17)}};
  return report;
}

// What a line says of `what`; empty where there is none.
std::string ValueOf(const std::string& text, const std::string& what) {
  const size_t at = text.find("\n" + what + " ");
  if (at == std::string::npos) return "";
  const size_t value = text.find_first_not_of(' ', at + 1 + what.size());
  return text.substr(value, text.find('\n', value) - value);
}

TEST(CodingReportTextTest, CountsBecomeSharesOfTheirWhole) {
  const std::string text = CodingReportText(SmallBoard(), SmallReport(), nullptr);
  EXPECT_THAT(text, ::testing::StartsWith(
                        "colours: red 25.0 %, green 16.7 %, yellow 16.7 %, blue 16.7 %, magenta 8.3 "
                        "%, cyan 8.3 %, white 8.3 %\nneighbours of equal colour: 5 pairs\n"));
  EXPECT_EQ(ValueOf(text, "3x3 windows"), "200");
  EXPECT_EQ(ValueOf(text, "one wrong colour reads as another window"), "1.23 %");
  EXPECT_EQ(ValueOf(text, "windows with another one wrong colour away"), "25.0 %");
  EXPECT_EQ(ValueOf(text, "one cell unread: more than one window fits"), "45.6 %");
  EXPECT_EQ(ValueOf(text, "windows that read as another in a mirror"), "1.50 % (3)");
  EXPECT_EQ(ValueOf(text, "equal diagonal neighbours"), "25.0 %");
  // The largest distance that occurred; a size without samples has none.
  EXPECT_EQ(ValueOf(text, "nearest other 3x3 window, cells that differ"), "2 to 6, mean 3.50");
  EXPECT_EQ(ValueOf(text, "nearest other 4x4 window, cells that differ"), "-");
  EXPECT_THAT(text, Not(HasSubstr(" \n")));
}

TEST(CodingReportTextTest, ARandomBoardStandsBesideIt) {
  CodingReport random = SmallReport();
  random.alias_odds = 0.5;
  const std::string text = CodingReportText(SmallBoard(), SmallReport(), &random);
  EXPECT_THAT(text, HasSubstr("this board              random board\n"));
  EXPECT_THAT(ValueOf(text, "one wrong colour reads as another window"),
              ::testing::MatchesRegex("1.23 % +50.00 %"));
}

TEST(CodingReportTextTest, ABoardWithoutWindowsDividesByNothing) {
  CodingReport report;
  const std::string text = CodingReportText(Board(), report, nullptr);
  EXPECT_EQ(ValueOf(text, "windows with another one wrong colour away"), "0.0 %");
  EXPECT_THAT(text, HasSubstr("colours: red 0.0 %, "));
}

TEST(CodingReportTextTest, JsonHasAllOfIt) {
  CodingReport report = SmallReport();
  report.distances.resize(1);
  const Board board = SmallBoard();
  const std::string expected =
      "{\"rows\": 3, \"cols\": 4, \"hash\": \"" + board.ContentHash() +
      "\", \"unique\": false, \"equal_neighbours\": 5, \"colors\": {\"red\": 3, \"green\": 2, \"yellow\": 2, "
      "\"blue\": 2, \"magenta\": 1, \"cyan\": 1, \"white\": 1}, \"windows\": 200, \"alias_odds\": 0.012300, "
      "\"one_away_share\": 0.250000, \"erasure_odds\": 0.456000, \"mirrored_windows\": 3, "
      "\"equal_diagonal_share\": 0.250000, \"nearest\": [{\"size\": 3, \"samples\": 10, \"least\": 2, "
      "\"mean\": "
      "3.5000, \"by_distance\": [0, 0, 1, 4, 3, 1, 1, 0, 0, 0]}], \"clashes\": [{\"row_a\": 1, \"col_a\": 2, "
      "\"row_b\": 3, \"col_b\": 4, \"quarter_turns\": 1}]}";
  EXPECT_EQ(CodingReportJson(board, report, nullptr, {{1, 2, 3, 4, 1}}), expected);
  EXPECT_THAT(CodingReportJson(board, report, &report, {}), HasSubstr(", \"random\": {\"windows\": 200, "));
  EXPECT_THAT(CodingReportJson(board, report, nullptr, {}), HasSubstr("\"unique\": true"));
}

}  // namespace
}  // namespace weft
