#include "learning/table_file.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/capture/temp_folder.h"

namespace weft::learning {
namespace {

TEST(TableFile, BringsTablesBack) {
  const TempFolder folder;
  const std::string path = folder / "tables.bin";
  WriteBytes(
      path, EncodeTables({{"a", {2, 3, {1, 2, 3, 4, 5, 6}}}, {"empty", {0, 3, {}}}, {"b", {1, 1, {-0.5f}}}}));
  const auto read = ReadTables(path);
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read.at("a").rows, 2u);
  EXPECT_EQ(read.at("a").columns, 3u);
  EXPECT_EQ(read.at("a").values, (std::vector<float>{1, 2, 3, 4, 5, 6}));
  EXPECT_TRUE(read.at("empty").values.empty());
  EXPECT_EQ(read.at("b").values, std::vector<float>{-0.5f});
}

TEST(TableFile, RefusesWhatIsDamaged) {
  const TempFolder folder;
  const std::string path = folder / "tables.bin";
  const std::string whole = EncodeTables({{"a", {2, 3, {1, 2, 3, 4, 5, 6}}}});
  for (size_t size = 0; size < whole.size(); ++size) {
    WriteBytes(path, whole.substr(0, size));
    EXPECT_THROW(ReadTables(path), std::runtime_error) << size;
  }
  std::string other = whole;
  other[20] ^= 1;
  WriteBytes(path, other);
  EXPECT_THROW(ReadTables(path), std::runtime_error);
  EXPECT_THROW(ReadTables(folder / "none.bin"), std::runtime_error);
}

}  // namespace
}  // namespace weft::learning
