#include "services/studio/recording/take_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/studio/recording/take_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

void Record(const std::string& folder) {
  PatternFrames cameras({"left"}, 64, 48, RawFormat::kMono8);
  RecordPattern(folder, cameras);
}

TEST(DescribeTakeFile, KeepsWhatIsNotGiven) {
  const TempFolder temp;
  Record(temp / "take");
  ASSERT_TRUE(
      DescribeTakeFile(temp / "take", {.slate = "12A take 3", .name = {}, .notes = "wet\nsleeve"}).ok());
  const auto take = DescribeTakeFile(temp / "take", {.slate = {}, .name = "walk", .notes = {}});
  ASSERT_TRUE(take.ok()) << take.status();
  const auto file = ReadTakeFileStrictly(temp / "take");
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->take.slate(), "12A take 3");
  EXPECT_EQ(file->take.name(), "walk");
  EXPECT_EQ(file->take.notes(), "wet\nsleeve");
}

TEST(DescribeTakeFile, RefusesWhatIsNoLine) {
  const TempFolder temp;
  Record(temp / "take");
  const auto why = [&](const TakeDescription& description) {
    return std::string(DescribeTakeFile(temp / "take", description).status().message());
  };
  EXPECT_THAT(why({.slate = "a\nb", .name = {}, .notes = {}}), HasSubstr("slate: must be UTF-8 text"));
  EXPECT_THAT(why({.slate = {}, .name = std::string(256, 'x'), .notes = {}}), HasSubstr("name: 256 bytes"));
  EXPECT_TRUE(absl::IsNotFound(DescribeTakeFile(temp / "none", {}).status()));
}

TEST(HasWords, WantsAllOfThem) {
  EXPECT_TRUE(HasWords("", {}));
  EXPECT_TRUE(HasWords(" walk  12a ", {"12A take 3", "a slow Walk"}));
  EXPECT_FALSE(HasWords("walk 13", {"12A take 3", "a slow Walk"}));
}

TEST(FindTakes, LooksIntoFoldersOfFolders) {
  // No identifier of a take, which is hexadecimal, has an R.
  const TempFolder temp;
  Record(temp / "day/one");
  Record(temp / "day/two/take");
  ASSERT_TRUE(DescribeTakeFile(temp / "day/two/take", {.slate = "12R", .name = {}, .notes = {}}).ok());
  EXPECT_THAT(*FindTakes(temp / "day", ""), SizeIs(2));
  const auto found = FindTakes(temp / "day", "12r");
  ASSERT_THAT(*found, SizeIs(1));
  EXPECT_EQ(found->front().folder, temp / "day/two/take");
  EXPECT_EQ(found->front().take.slate(), "12R");
  EXPECT_THAT(*FindTakes(temp / "day/one", ""), SizeIs(1));
  EXPECT_TRUE(absl::IsNotFound(FindTakes(temp / "night", "").status()));
}

}  // namespace
}  // namespace weft
