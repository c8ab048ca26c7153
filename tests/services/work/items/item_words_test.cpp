#include "services/work/items/item_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(ItemWords, ReferencesAreNamesVersionsOrHashes) {
  const auto latest = ParseItemReference("dome-3"), second = ParseItemReference("dome-3@2"),
             exact = ParseItemReference("sha256:" + std::string(64, 'a'));
  ASSERT_TRUE(latest.ok() && second.ok() && exact.ok());
  EXPECT_EQ(latest->name, "dome-3");
  EXPECT_FALSE(latest->version.has_value());
  EXPECT_EQ(second->version, 2);
  EXPECT_EQ(exact->id, std::string(64, 'a'));
  EXPECT_EQ(exact->name, "");
}

TEST(ItemWords, OtherReferencesAreRefusedWithTheFault) {
  EXPECT_THAT(std::string(ParseItemReference("sha256:abc").status().message()),
              HasSubstr("64 lower-case hex digits"));
  EXPECT_THAT(std::string(ParseItemReference("dome@0").status().message()), HasSubstr("dome@2"));
  EXPECT_THAT(std::string(ParseItemReference("dome@").status().message()),
              HasSubstr("item: the version \"\""));
  EXPECT_THAT(std::string(ParseItemReference("@2").status().message()), HasSubstr("name: "));
}

TEST(ItemWords, NamesHaveAHundredPlainCharacters) {
  EXPECT_TRUE(CheckItemName(std::string(100, 'x')).ok());
  EXPECT_TRUE(CheckItemName("7.Rig_a-b").ok());
  for (const std::string& name :
       {std::string(101, 'x'), std::string(), std::string(".hidden"), std::string("a/b"), std::string("a b")})
    EXPECT_TRUE(absl::IsInvalidArgument(CheckItemName(name))) << name;
}

TEST(ItemWords, PathsGiveNamesThatMayBeUsed) {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "shirt.v2");
  EXPECT_EQ(ItemNameOfPath(folder / "rig 7.json"), "rig-7");
  EXPECT_EQ(ItemNameOfPath(folder / "shirt.v2"), "shirt.v2");
  EXPECT_EQ(ItemNameOfPath(folder / "shirt.v2/"), "shirt.v2");
  EXPECT_EQ(ItemNameOfPath(folder / "_x.json"), "item_x");
  EXPECT_EQ(ItemNameOfPath(folder / std::string(120, 'n')), std::string(100, 'n'));
}

TEST(ItemWords, KindsAreReadAsTheyAreWritten) {
  for (const v1::ItemKind kind : {v1::ITEM_KIND_RIG, v1::ITEM_KIND_AVATAR}) {
    const auto read = ParseItemKind(ItemKindWord(kind));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(*read, kind);
  }
  EXPECT_THAT(std::string(ParseItemKind("Rig").status().message()), HasSubstr("kind: \"Rig\" is none"));
  EXPECT_FALSE(CheckItemKind(v1::ITEM_KIND_UNSPECIFIED).ok());
  EXPECT_FALSE(CheckItemKind(static_cast<v1::ItemKind>(99)).ok());
}

TEST(ItemWords, HashesAreSixtyFourLowerHexDigits) {
  EXPECT_TRUE(IsSha256(std::string(60, 'f') + "0129"));
  EXPECT_FALSE(IsSha256(std::string(63, 'f')));
  EXPECT_FALSE(IsSha256(std::string(64, 'F')));
  EXPECT_FALSE(IsSha256(std::string(64, 'g')));
}

}  // namespace
}  // namespace weft
