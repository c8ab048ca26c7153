#include "services/work/items/item_path.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

class ItemPathTest : public ::testing::Test {
 protected:
  absl::StatusOr<PlaceInItem> Find(const std::string& path, ConfinedFolder::IfMissing missing) {
    return FindPlace(root_, path, missing);
  }

  const TempFolder folder_;
  const std::string root_ = fs::canonical(folder_.path()).string();
};

TEST_F(ItemPathTest, FoldersOnTheWayAreMadeWhereThatIsAskedFor) {
  EXPECT_EQ(Find("a/b/c.png", ConfinedFolder::IfMissing::kFail).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(fs::exists(root_ + "/a"));
  const auto place = Find("a/b/c.png", ConfinedFolder::IfMissing::kMake);
  ASSERT_TRUE(place.ok()) << place.status();
  EXPECT_EQ(place->name, "c.png");
  EXPECT_TRUE(fs::is_directory(root_ + "/a/b"));
  EXPECT_FALSE(fs::exists(root_ + "/a/b/c.png"));
  WriteBytes(root_ + "/a/b/c.png", "image");
  EXPECT_EQ(*place->folder.Read("c.png"), "image");
  WriteBytes(root_ + "/d.png", "another");
  EXPECT_EQ(*Find("d.png", ConfinedFolder::IfMissing::kFail)->folder.Read("d.png"), "another");
}

TEST_F(ItemPathTest, NothingLeadsElsewhere) {
  fs::create_directory_symlink("/etc", root_ + "/link");
  for (const char* path : {"../x", "/etc/passwd", "a/../../x", "link/passwd", ""})
    EXPECT_FALSE(Find(path, ConfinedFolder::IfMissing::kMake).ok()) << path;
  EXPECT_FALSE(FindPlace(root_ + "/none", "a", ConfinedFolder::IfMissing::kFail).ok());
}

}  // namespace
}  // namespace weft
