#include "services/results/evaluation/csv_text.h"

#include <gtest/gtest.h>

#include <limits>

namespace weft {
namespace {

// RFC 4180.
TEST(CsvText, NamesThatBreakALineAreQuoted) {
  EXPECT_EQ(CsvName("frame 7"), "frame 7");
  EXPECT_EQ(CsvName("a,b"), "\"a,b\"");
  EXPECT_EQ(CsvName("say \"a\""), "\"say \"\"a\"\"\"");
  EXPECT_EQ(CsvName("a\nb"), "\"a\nb\"");
}

TEST(CsvText, FieldsWithoutANumberAreEmpty) {
  std::string line = "x";
  AppendCsvNumber(1.23456789, line);
  AppendCsvNumber(std::nullopt, line);
  AppendCsvNumber(std::numeric_limits<double>::infinity(), line);
  AppendCsvNumber(-2, line);
  EXPECT_EQ(line, "x,1.23457,,,-2");
}

}  // namespace
}  // namespace weft
