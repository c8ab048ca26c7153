// Files of this machine as items, and content that no job could read.
#include "services/work/items/check_item.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "capture/image/image_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/template_file.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/items/item_files.h"
#include "services/work/items/item_words.h"
#include "tests/animation/shift_net.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/small_avatar.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class ItemContent : public ::testing::Test {
 protected:
  ItemContent() : board_(*GenerateBoard(6, 6, 2.7, 1)) {
    EXPECT_TRUE(WriteBoard(folder_ / "board", board_, "").ok());
    const TriangleMesh mesh{{{0, 0, 0.1}, {2.7, 0, 0}, {0, 2.7, 0}}, {{0, 2, 1}}};
    const auto garment = ImportTemplate("shirt", mesh, {{0, 0}, {0, 1}, {1, 0}}, board_);
    EXPECT_TRUE(garment.ok()) << garment.status();
    EXPECT_TRUE(WriteTemplate(folder_ / "shirt", *garment, "").ok());
    for (const char* image : {"dump/0001/a.png", "dump/0001/b.png"}) {
      std::filesystem::create_directories(folder_ / "dump/0001");
      EXPECT_TRUE(WriteImageFile(folder_ / image, BoardToImage(board_)).ok());
    }
  }

  // What the check says of `path` where the daemon has its files.
  absl::Status Check(v1::ItemKind kind, const std::string& path) {
    const auto files = ListLocalItem(kind, folder_ / path);
    if (!files.ok()) return files.status();
    const std::string folder = folder_ / "state/content";
    std::filesystem::remove_all(folder);
    for (size_t i = 0; i < files->paths.size(); ++i) {
      WriteBytes(folder + "/" + files->manifest.files(static_cast<int>(i)).path(),
                 ReadBytes(files->paths[i]));
    }
    return CheckItemContent(kind, files->manifest, folder);
  }
  // The same, for what must be refused.
  std::string Refusal(v1::ItemKind kind, const std::string& path) {
    const absl::Status status = Check(kind, path);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("state/content")));
    return std::string(status.message());
  }
  void Replace(const std::string& path, const std::string& part, const std::string& text) {
    std::string bytes = ReadBytes(folder_ / path);
    ASSERT_NE(bytes.find(part), std::string::npos) << bytes;
    WriteBytes(folder_ / path, bytes.replace(bytes.find(part), part.size(), text));
  }

  TempFolder folder_;
  const Board board_;
};

TEST_F(ItemContent, IsTakenAsJobsTakeIt) {
  EXPECT_TRUE(Check(v1::ITEM_KIND_BOARD, "board").ok()) << Check(v1::ITEM_KIND_BOARD, "board");
  EXPECT_TRUE(Check(v1::ITEM_KIND_BOARD, "board/board.json").ok());
  EXPECT_TRUE(Check(v1::ITEM_KIND_BOARD, "board/board.png").ok());
  EXPECT_TRUE(Check(v1::ITEM_KIND_TEMPLATE, "shirt").ok()) << Check(v1::ITEM_KIND_TEMPLATE, "shirt");
  EXPECT_TRUE(Check(v1::ITEM_KIND_TEMPLATE, "shirt/template.json").ok());
  EXPECT_TRUE(Check(v1::ITEM_KIND_DUMP, "dump").ok()) << Check(v1::ITEM_KIND_DUMP, "dump");
  std::filesystem::rename(folder_ / "board/board.json", folder_ / "board/stripes.json");
  EXPECT_TRUE(Check(v1::ITEM_KIND_BOARD, "board/stripes.json").ok());
}

TEST_F(ItemContent, OfABoardMustFitTogether) {
  Replace("board/board.json", "\"rows\": 6", "\"rows\": 8");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_BOARD, "board"),
              AllOf(HasSubstr("board.json"), HasSubstr("rows says 8"), HasSubstr("do not belong together")));
  WriteBytes(folder_ / "board/board.png", "no image");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_BOARD, "board/board.png"), HasSubstr("board.png"));
  std::filesystem::remove(folder_ / "board/board.png");
  EXPECT_THAT(std::string(Check(v1::ITEM_KIND_BOARD, "board").message()), HasSubstr("board/board.png"));
}

TEST_F(ItemContent, OfATemplateMustBeWhole) {
  Replace("shirt/template.json", "\"mesh\"", "\"surface\"");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_TEMPLATE, "shirt"),
              AllOf(HasSubstr("template.json"), HasSubstr("surface")));
  Replace("shirt/template.json", "\"surface\"", "\"mesh\"");
  std::filesystem::remove(folder_ / "shirt/mesh.ply");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_TEMPLATE, "shirt"), HasSubstr("mesh.ply"));
}

TEST_F(ItemContent, OfADumpMustBeFramesOfCameras) {
  WriteBytes(folder_ / "notes/read.me", "x");
  EXPECT_THAT(
      Refusal(v1::ITEM_KIND_DUMP, "notes"),
      AllOf(HasSubstr("neither a recorded take nor a folder of images"), HasSubstr("<frame>/<camera>")));
  WriteBytes(folder_ / "notes/take.json", "{\"cameras\": 7}");
  WriteBytes(folder_ / "notes/streams/a.stream", "x");
  Refusal(v1::ITEM_KIND_DUMP, "notes");
}

TEST_F(ItemContent, OfAnAvatarAreItsFiles) {
  v1::Avatar about;
  const SparseViewAvatar avatar = SmallAvatar();
  ASSERT_TRUE(WriteAvatar(folder_ / "shirt.avatar", about, avatar).ok());
  EXPECT_TRUE(Check(v1::ITEM_KIND_AVATAR, "shirt.avatar").ok())
      << Check(v1::ITEM_KIND_AVATAR, "shirt.avatar");
  EXPECT_THAT(std::string(Check(v1::ITEM_KIND_AVATAR, "shirt.avatar/avatar.json").message()),
              HasSubstr("give the folder of the avatar"));
  EXPECT_THAT(Refusal(v1::ITEM_KIND_AVATAR, "shirt"), HasSubstr("an avatar is avatar.json and space.bin"));
  std::string space = ReadBytes(folder_ / "shirt.avatar/space.bin");
  space[space.size() / 2] ^= 1;
  WriteBytes(folder_ / "shirt.avatar/space.bin", space);
  EXPECT_THAT(std::string(Check(v1::ITEM_KIND_AVATAR, "shirt.avatar").message()),
              AllOf(HasSubstr("space.bin"), Not(HasSubstr("state/content"))));
  WriteBytes(folder_ / "shirt.avatar/notes.txt", "more");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_AVATAR, "shirt.avatar"), HasSubstr("other files are given"));
}

TEST_F(ItemContent, OfANetAreBothFilesOrNone) {
  SparseViewAvatar avatar = SmallAvatar();
  avatar.net = ShiftNet();
  ASSERT_TRUE(WriteAvatar(folder_ / "shirt.avatar", {}, avatar).ok());
  EXPECT_TRUE(Check(v1::ITEM_KIND_AVATAR, "shirt.avatar").ok())
      << Check(v1::ITEM_KIND_AVATAR, "shirt.avatar");
  const std::string net = ReadBytes(folder_ / "shirt.avatar/net.onnx");
  WriteBytes(folder_ / "shirt.avatar/net.onnx", net + "x");
  EXPECT_THAT(std::string(Check(v1::ITEM_KIND_AVATAR, "shirt.avatar").message()),
              AllOf(HasSubstr("net.onnx"), Not(HasSubstr("state/content"))));
  WriteBytes(folder_ / "shirt.avatar/net.onnx", net);
  std::filesystem::remove(folder_ / "shirt.avatar/sample.bin");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_AVATAR, "shirt.avatar"), HasSubstr("other files are given"));
}

TEST_F(ItemContent, OfANetIsCheckedThoughNobodyRunsIt) {
  SparseViewAvatar avatar = SmallAvatar();
  avatar.net = ShiftNet();
  avatar.net.onnx += "r\x01x";  // metadata_props, which our nets do not have
  ASSERT_TRUE(WriteAvatar(folder_ / "shirt.avatar", {}, avatar).ok());
  const absl::Status status = Check(v1::ITEM_KIND_AVATAR, "shirt.avatar");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("net.onnx"), HasSubstr("has field 14")));
}

TEST_F(ItemContent, IsListedWithoutLinks) {
  const auto dump = ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "dump");
  ASSERT_TRUE(dump.ok()) << dump.status();
  EXPECT_EQ(dump->manifest.files(1).path(), "0001/b.png");
  EXPECT_THAT(dump->paths, ElementsAre(folder_ / "dump/0001/a.png", folder_ / "dump/0001/b.png"));
  ASSERT_EQ(symlink("/etc/passwd", (folder_ / "dump/0001/c.png").c_str()), 0);
  const absl::Status link = ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "dump").status();
  EXPECT_EQ(link.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(link.message()), AllOf(HasSubstr("c.png"), HasSubstr("put a copy")));
  EXPECT_EQ(ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "none").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ListLocalItem(v1::ITEM_KIND_DUMP, folder_ / "board/board.png").status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(ItemContent, HasTheNameOfItsPath) {
  EXPECT_EQ(ItemNameOfPath(folder_ / "shirt/"), "shirt");
  EXPECT_EQ(ItemNameOfPath(folder_ / "board/board.json"), "board");
  EXPECT_EQ(ItemNameOfPath("/data/take of monday"), "take-of-monday");
  EXPECT_TRUE(CheckItemName(ItemNameOfPath("/")).ok());
  EXPECT_TRUE(CheckItemName(ItemNameOfPath("/" + std::string(150, '_'))).ok());
}

TEST(InputPathOf, IsTheFileOfWhatIsOne) {
  v1::ItemManifest one, two;
  one.add_files()->set_path("a.png");
  two.add_files()->set_path("a.png");
  two.add_files()->set_path("b.json");
  for (const v1::ItemKind kind : {v1::ITEM_KIND_RIG, v1::ITEM_KIND_BOARD, v1::ITEM_KIND_GARMENT})
    EXPECT_EQ(InputPathOf(kind, one, "/item"), "/item/a.png") << kind;
  for (const v1::ItemKind kind : {v1::ITEM_KIND_TEMPLATE, v1::ITEM_KIND_DUMP, v1::ITEM_KIND_AVATAR})
    EXPECT_EQ(InputPathOf(kind, one, "/item"), "/item") << kind;
  EXPECT_EQ(InputPathOf(v1::ITEM_KIND_BOARD, two, "/item"), "/item/b.json");
  EXPECT_EQ(InputPathOf(v1::ITEM_KIND_GARMENT, two, "/item"), "/item");
}

TEST_F(ItemContent, OfAGarmentIsEachOfItsMeshes) {
  const std::string obj = "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n";
  WriteBytes(folder_ / "walk/0001.obj", obj);
  WriteBytes(folder_ / "walk/0002.obj", obj);
  EXPECT_TRUE(Check(v1::ITEM_KIND_GARMENT, "walk").ok()) << Check(v1::ITEM_KIND_GARMENT, "walk");
  WriteBytes(folder_ / "walk/0002.obj", "no mesh");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_GARMENT, "walk"), HasSubstr("0002.obj"));
  WriteBytes(folder_ / "walk/0002.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 1 1 1\nf 1 2 3\nf 1 4 2\n");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_GARMENT, "walk"),
              HasSubstr("0002.obj: has other vertices or faces than 0001"));
  WriteBytes(folder_ / "metres/0001.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_GARMENT, "metres"),
              HasSubstr("0001.obj: the garment is 0.1414 mm across"));
  v1::ItemManifest manifest;
  manifest.add_files()->set_path("notes.txt");
  EXPECT_THAT(std::string(CheckItemContent(v1::ITEM_KIND_GARMENT, manifest, folder_.path()).message()),
              HasSubstr("notes.txt is neither .obj nor .ply"));
}

TEST_F(ItemContent, OfARigIsOneFile) {
  WriteBytes(folder_ / "rig.json", "{\"cameras\": 7}");
  EXPECT_THAT(Refusal(v1::ITEM_KIND_RIG, "rig.json"), HasSubstr("rig.json"));
  v1::ItemManifest manifest;
  manifest.add_files()->set_path("rig.json");
  manifest.add_files()->set_path("more.json");
  EXPECT_EQ(CheckItemContent(v1::ITEM_KIND_RIG, manifest, folder_.path()).message(),
            "manifest.files: a rig is one rig.json, 2 files are given");
}

}  // namespace
}  // namespace weft
