#include "services/formats/files/moved_folder.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

TEST(MoveFolder, MakesTheParentsOfItsPlace) {
  const TempFolder temp;
  fs::create_directories(temp / "a");
  WriteBytes(temp / "a/file", "content");
  ASSERT_TRUE(MoveFolder(temp / "a", temp / "b/c/d").ok());
  EXPECT_FALSE(fs::exists(temp / "a"));
  EXPECT_EQ(ReadBytes(temp / "b/c/d/file"), "content");
  EXPECT_FALSE(MoveFolder(temp / "a", temp / "e").ok());
}

// As if the process were killed between the two steps: nothing of the folder has its name any more.
TEST(PutAside, TakesAWholeFolderOutOfSight) {
  const TempFolder temp;
  for (const char* name : {"one", "two"}) {
    fs::create_directories(temp / name);
    WriteBytes(temp / (std::string(name) + "/file"), name);
  }
  ASSERT_TRUE(PutAside(temp / "one", ".gone-").ok());
  EXPECT_FALSE(fs::exists(temp / "one"));
  EXPECT_EQ(ReadBytes(temp / ".gone-one/file"), "one");
  EXPECT_TRUE(PutAside(temp / "one", ".gone-").ok()) << "there is none";
  EXPECT_EQ(ReadBytes(temp / ".gone-one/file"), "one");
  // A new one of the name, before anybody removed what is left of the first.
  fs::create_directories(temp / "one");
  ASSERT_TRUE(PutAside(temp / "one", ".gone-").ok());
  EXPECT_TRUE(fs::is_empty(temp / ".gone-one"));

  ASSERT_TRUE(RemoveAside(temp.path(), ".gone-").ok());
  EXPECT_FALSE(fs::exists(temp / ".gone-one"));
  EXPECT_EQ(ReadBytes(temp / "two/file"), "two");
  EXPECT_TRUE(RemoveAside(temp / "nowhere", ".gone-").ok());
}

// A link is moved and removed, not what it leads to.
TEST(PutAside, FollowsNoLink) {
  const TempFolder temp;
  fs::create_directories(temp / "kept");
  WriteBytes(temp / "kept/file", "content");
  fs::create_directories(temp / "trash");
  fs::create_directory_symlink(temp / "kept", temp / "trash/link");
  ASSERT_TRUE(PutAside(temp / "trash/link", ".gone-").ok());
  ASSERT_TRUE(RemoveAside(temp / "trash", ".gone-").ok());
  EXPECT_TRUE(fs::is_empty(temp / "trash"));
  EXPECT_EQ(ReadBytes(temp / "kept/file"), "content");
}

}  // namespace
}  // namespace weft
