#include "services/work/items/item_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <utility>
#include <vector>

#include "services/work/items/manifest.h"
#include "services/work/items/sha256.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ItemFilesTest : public ::testing::Test {
 protected:
  std::vector<std::string> Names(v1::ItemKind kind, const std::string& path) {
    const auto item = ListLocalItem(kind, folder_ / path);
    EXPECT_TRUE(item.ok()) << item.status();
    std::vector<std::string> names;
    if (!item.ok()) return names;
    for (const v1::ItemFile& file : item->manifest.files()) names.push_back(file.path());
    EXPECT_TRUE(CheckManifest(item->manifest).ok()) << CheckManifest(item->manifest);
    return names;
  }
  std::string WhyNot(v1::ItemKind kind, const std::string& path) {
    return std::string(ListLocalItem(kind, folder_ / path).status().message());
  }

  const TempFolder folder_;
};

TEST_F(ItemFilesTest, AreListedInOrderWithSizesAndHashes) {
  WriteBytes(folder_ / "dump/b/2.png", "abc");
  WriteBytes(folder_ / "dump/a/1.png", "");
  std::vector<std::pair<uint64_t, uint64_t>> told;
  const auto item = ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "dump/",
                                  [&](uint64_t done, uint64_t total) { told.emplace_back(done, total); });
  ASSERT_TRUE(item.ok()) << item.status();
  ASSERT_EQ(item->manifest.files_size(), 2);
  EXPECT_EQ(item->manifest.files(0).path(), "a/1.png");
  EXPECT_EQ(item->manifest.files(0).bytes(), 0);
  EXPECT_EQ(item->manifest.files(1).bytes(), 3);
  EXPECT_EQ(item->manifest.files(1).sha256(), Sha256().Add("abc").Hex());
  EXPECT_THAT(item->paths, ElementsAre(folder_ / "dump/a/1.png", folder_ / "dump/b/2.png"));
  EXPECT_THAT(told, ElementsAre(std::pair(3, 3)));
}

TEST_F(ItemFilesTest, OfABoardAreTheImagesThatItNames) {
  WriteBytes(folder_ / "plain/board.json", "{}");
  for (const char* image : {"board.png", "other.png"})
    WriteBytes(folder_ / ("plain/" + std::string(image)), "x");
  EXPECT_THAT(Names(v1::ITEM_KIND_BOARD, "plain"), ElementsAre("board.json", "board.png"));
  WriteBytes(folder_ / "cut/stripes.json", R"({"image": "ink.png", "panels": "panels.png"})");
  for (const char* image : {"ink.png", "panels.png", "board.png"})
    WriteBytes(folder_ / ("cut/" + std::string(image)), "x");
  EXPECT_THAT(Names(v1::ITEM_KIND_BOARD, "cut/stripes.json"),
              ElementsAre("ink.png", "panels.png", "stripes.json"));
  EXPECT_THAT(Names(v1::ITEM_KIND_BOARD, "cut/board.png"), ElementsAre("board.png"));
  fs::remove(folder_ / "cut/panels.png");
  EXPECT_EQ(ListLocalItem(v1::ITEM_KIND_BOARD, folder_ / "cut/stripes.json").status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_BOARD, "cut/stripes.json"), HasSubstr("cut/panels.png"));
  WriteBytes(folder_ / "up/board.json", R"({"image": "../board.png"})");
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_BOARD, "up"), HasSubstr("../board.png"));
}

TEST_F(ItemFilesTest, OfEachKindAreWhatItIsGivenAs) {
  WriteBytes(folder_ / "shirt/template.json", "{}");
  WriteBytes(folder_ / "shirt/mesh.ply", "x");
  EXPECT_THAT(Names(v1::ITEM_KIND_TEMPLATE, "shirt"), ElementsAre("mesh.ply", "template.json"));
  EXPECT_THAT(Names(v1::ITEM_KIND_TEMPLATE, "shirt/template.json"), ElementsAre("mesh.ply", "template.json"));
  EXPECT_THAT(Names(v1::ITEM_KIND_RIG, "shirt/template.json"), ElementsAre("template.json"));
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_RIG, "shirt"), HasSubstr("is a folder; give the rig.json in it"));
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_DUMP, "shirt/mesh.ply"), HasSubstr("give the folder of the dump"));
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_AVATAR, "shirt/mesh.ply"), HasSubstr("give the folder of the avatar"));
  EXPECT_THAT(Names(v1::ITEM_KIND_AVATAR, "shirt"), ElementsAre("mesh.ply", "template.json"));
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_RIG, "none.json"), HasSubstr("none.json: no such file"));
}

TEST_F(ItemFilesTest, OfAGarmentAreItsMeshesAlone) {
  for (const char* name : {"a.obj", "b.PLY", "a.mtl", "pictures/a.png"})
    WriteBytes(folder_ / ("walk/" + std::string(name)), "x");
  EXPECT_THAT(Names(v1::ITEM_KIND_GARMENT, "walk"), ElementsAre("a.obj", "b.PLY"));
  EXPECT_THAT(Names(v1::ITEM_KIND_GARMENT, "walk/a.obj"), ElementsAre("a.obj"));
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_GARMENT, "walk/pictures"), HasSubstr("holds no .obj or .ply"));
}

TEST_F(ItemFilesTest, FoldersThatMakeNoItemAreRefused) {
  fs::create_directories(folder_ / "empty/within");
  EXPECT_EQ(ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "empty").status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_DUMP, "empty"), HasSubstr("holds no file"));
  fs::create_directory_symlink("/etc", folder_ / "empty/link");
  EXPECT_THAT(WhyNot(v1::ITEM_KIND_DUMP, "empty"),
              AllOf(HasSubstr("empty/link"), HasSubstr("no plain file")));
}

}  // namespace
}  // namespace weft
