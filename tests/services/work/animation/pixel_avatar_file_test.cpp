#include "services/work/animation/pixel_avatar_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "services/formats/files/atomic_file.h"
#include "services/work/animation/avatar_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/small_avatar.h"

namespace weft {
namespace {

using testing::HasSubstr;

PixelAvatar SmallPixels() {
  PixelAvatar out;
  out.template_hash = "0123456789abcdef", out.board_hash = "fedcba9876543210";
  out.vertices = 9;
  out.training_frames = 40;
  out.left_mm = 0.5;
  out.graph.nodes = 3;
  out.prior.unit.assign(12, 0.5f);
  out.prior.layers = {{1, 2, {1, 2}, {3, 4}}, {2, 12, std::vector<float>(24, 1), std::vector<float>(12, 0)}};
  std::ifstream file(WEFT_TEST_DATA "/pixels.onnx", std::ios::binary);
  out.net.onnx.assign(std::istreambuf_iterator<char>(file), {});
  out.net.atlas.level = 0;
  out.net.sample = {4, 1, 1, {1, 1, 1, 1}};
  out.net.sample_answer = {3, 1, 1, {0.5f, -0.25f, 1.5f}};
  return out;
}

TEST(PixelAvatarFile, KeepsTheAvatar) {
  const TempFolder folder;
  const std::string path = folder / "paper.avatar";
  ASSERT_TRUE(WritePixelAvatar(path, {}, SmallPixels()).ok());
  const absl::StatusOr<PixelAvatarFile> read = ReadPixelAvatar(path);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->about.kind(), "paper");
  EXPECT_EQ(read->avatar.template_hash, "0123456789abcdef");
  EXPECT_EQ(read->avatar.vertices, 9);
  EXPECT_EQ(read->avatar.left_mm, 0.5);
  EXPECT_EQ(read->avatar.prior.layers[1].weight, SmallPixels().prior.layers[1].weight);
  EXPECT_EQ(read->avatar.net.onnx, SmallPixels().net.onnx);
  EXPECT_EQ(ReadAnyAvatar(path)->components(), 1);
}

TEST(PixelAvatarFile, AvatarsOfOneKindAreNotTakenForTheOther) {
  const TempFolder folder;
  ASSERT_TRUE(WritePixelAvatar(folder / "paper.avatar", {}, SmallPixels()).ok());
  ASSERT_TRUE(WriteAvatar(folder / "shirt.avatar", {}, SmallAvatar()).ok());
  const absl::Status driven = ReadAvatar(folder / "paper.avatar").status(),
                     compared = ReadPixelAvatar(folder / "shirt.avatar").status();
  for (const absl::Status& status : {driven, compared}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr("--baseline"));
  }
  EXPECT_EQ(ReadAnyAvatar(folder / "shirt.avatar")->kind(), "sparse-view");
}

TEST(PixelAvatarFile, RefusesANetThatAnswersOtherwise) {
  const TempFolder folder;
  PixelAvatar avatar = SmallPixels();
  avatar.net.sample_answer.values[2] = 1.4f;
  ASSERT_TRUE(WritePixelAvatar(folder / "paper.avatar", {}, avatar).ok());
  EXPECT_THAT(std::string(ReadPixelAvatar(folder / "paper.avatar").status().message()),
              HasSubstr("net.onnx"));
}

TEST(PixelAvatarFile, RefusesDamage) {
  const TempFolder folder;
  const std::string path = folder / "paper.avatar";
  ASSERT_TRUE(WritePixelAvatar(path, {}, SmallPixels()).ok());
  std::string bytes = *ReadWholeFile(path + "/space.bin");
  bytes[bytes.size() / 2] ^= 1;
  ASSERT_TRUE(WriteFileAtomically(path + "/space.bin", bytes).ok());
  EXPECT_EQ(ReadPixelAvatar(path).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace weft
