#include "services/formats/synthetic/frames_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using Eigen::Vector3d;

FramesHead SmallHead() { return {"0123456789abcdef", 3, 25, true}; }

ClothFrame SmallFrame(double size_mm) {
  ClothFrame out;
  out.time_ns = 40'000'000;
  out.vertices_mm = {Vector3d(1000, 2000, -500), Vector3d(1000 + size_mm, 2000.3, -500.7),
                     Vector3d(1003, 2002, -499)};
  out.pose.emplace();
  out.pose->root_mm = {1, 2, 3};
  return out;
}

TEST(FramesFile, KeepsPositionsWithinHalfAStep) {
  // Up to a metre the step is 1/64 mm, up to two it is 1/32.
  for (const auto& [size_mm, step_mm] : {std::pair(800.0, 1.0 / 64), std::pair(1500.0, 1.0 / 32)}) {
    const ClothFrame frame = SmallFrame(size_mm);
    const std::string bytes = EncodeClothFrame(SmallHead(), frame);
    EXPECT_EQ(bytes.size(), ClothFrameBytes(SmallHead()));
    const absl::StatusOr<ClothFrame> read = DecodeClothFrame(SmallHead(), bytes, "frames.bin");
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->time_ns, frame.time_ns);
    EXPECT_EQ(read->pose->root_mm, frame.pose->root_mm);
    double worst = 0;
    for (size_t v = 0; v < 3; ++v)
      worst = std::max(worst, (read->vertices_mm[v] - frame.vertices_mm[v]).cwiseAbs().maxCoeff());
    EXPECT_LE(worst, step_mm / 2 + 1e-9);
    EXPECT_GT(worst, step_mm / 20);
  }
}

TEST(FramesFile, DamageIsFoundAndNamed) {
  std::string bytes = EncodeClothFrame(SmallHead(), SmallFrame(10));
  bytes[50] = static_cast<char>(bytes[50] ^ 4);
  const absl::StatusOr<ClothFrame> read = DecodeClothFrame(SmallHead(), bytes, "frames.bin: frame 3");
  EXPECT_EQ(read.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(read.status().message().find("frames.bin: frame 3"), std::string::npos);
  std::string head = EncodeFramesHead(SmallHead());
  EXPECT_EQ(DecodeFramesHead(head, "frames.bin")->template_hash, SmallHead().template_hash);
  head[12] = static_cast<char>(head[12] ^ 4);
  EXPECT_NE(DecodeFramesHead(head, "frames.bin").status().message().find("checksum"), std::string::npos);
  EXPECT_NE(DecodeFramesHead("ply\n", "frames.bin").status().message().find("weftseq1"), std::string::npos);
}

TEST(FramesFile, AnyFrameIsReadAndACutOffOneIsSeen) {
  const TempFolder folder;
  std::string bytes = EncodeFramesHead(SmallHead());
  for (const double size_mm : {1.0, 2.0, 3.0}) bytes += EncodeClothFrame(SmallHead(), SmallFrame(size_mm));
  WriteBytes(folder / "frames.bin", bytes);
  absl::StatusOr<FramesReader> reader = FramesReader::Open(folder / "frames.bin");
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ(reader->frames(), 3);
  for (const int k : {2, 0, 1}) EXPECT_NEAR(reader->Read(k)->vertices_mm[1].x(), 1000 + k + 1, 0.01);
  EXPECT_EQ(reader->Read(3).status().code(), absl::StatusCode::kOutOfRange);

  WriteBytes(folder / "cut.bin", bytes.substr(0, bytes.size() - 5));
  EXPECT_NE(FramesReader::Open(folder / "cut.bin").status().message().find("ends within frame 2"),
            std::string::npos);
  EXPECT_EQ(FramesReader::Open(folder / "cut.bin", true)->frames(), 2);
}

TEST(FramesFile, AHeadThatCannotBeIsRefused) {
  const auto why = [](uint32_t vertices, double fps) {
    const std::string bytes = EncodeFramesHead({"0123", vertices, fps, false});
    return std::string(DecodeFramesHead(bytes, "frames.bin").status().message());
  };
  EXPECT_EQ(why(1, 0.5), "");
  EXPECT_EQ(why(50'000'000, 1000), "");
  for (const auto& [vertices, fps] :
       {std::pair(0u, 25.0), std::pair(50'000'001u, 25.0), std::pair(1u, 0.0), std::pair(1u, -1.0),
        std::pair(1u, 1000.5), std::pair(1u, std::nan(""))})
    EXPECT_EQ(why(vertices, fps), "frames.bin: the head cannot be: vertices, fps or flags are out of range");
  const std::string head = EncodeFramesHead(SmallHead());
  for (const size_t bytes : {size_t{8}, size_t{20}, head.size() - 1})
    EXPECT_NE(
        DecodeFramesHead(head.substr(0, bytes), "frames.bin").status().message().find("ends within its head"),
        std::string::npos)
        << bytes;
  const auto read = DecodeFramesHead(head + "more", "frames.bin");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->vertices, 3u);
  EXPECT_EQ(read->fps, 25);
  EXPECT_TRUE(read->has_pose);
  EXPECT_FALSE(DecodeFramesHead(EncodeFramesHead({"", 1, 25, false}), "frames.bin")->has_pose);
}

TEST(FramesFile, FramesWithoutAPoseAreShorter) {
  FramesHead head = SmallHead();
  const size_t with_pose = ClothFrameBytes(head);
  head.has_pose = false;
  EXPECT_EQ(ClothFrameBytes(head), 8u + 24 + 1 + 18 + 8);
  ClothFrame frame = SmallFrame(10);
  const std::string bytes = EncodeClothFrame(head, frame);
  EXPECT_EQ(bytes.size(), ClothFrameBytes(head));
  EXPECT_LT(bytes.size(), with_pose);
  const auto read = DecodeClothFrame(head, bytes, "frames.bin");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_FALSE(read->pose.has_value());
  for (const std::string& other : {bytes.substr(1), bytes + "x"}) {
    const absl::Status status = DecodeClothFrame(head, other, "frames.bin").status();
    EXPECT_TRUE(absl::IsInvalidArgument(status));
    EXPECT_NE(status.message().find("bytes, expected 59"), std::string::npos) << status;
  }
}

TEST(FramesFile, ThePoseComesBackWithItsRotations) {
  ClothFrame frame = SmallFrame(10);
  for (size_t j = 0; j < frame.pose->rotation.size(); ++j)
    frame.pose->rotation[j] = Eigen::Quaterniond(
        Eigen::AngleAxisd(0.1 * static_cast<double>(j + 1), Vector3d(1, 2, 3).normalized()));
  const auto read = DecodeClothFrame(SmallHead(), EncodeClothFrame(SmallHead(), frame), "frames.bin");
  ASSERT_TRUE(read.ok()) << read.status();
  for (size_t j = 0; j < frame.pose->rotation.size(); ++j) {
    EXPECT_LT((read->pose->rotation[j].coeffs() - frame.pose->rotation[j].coeffs()).norm(), 1e-6) << j;
    EXPECT_NEAR(read->pose->rotation[j].norm(), 1, 1e-15);
  }
}

TEST(FramesFile, ReadersNameTheFile) {
  const TempFolder folder;
  const absl::Status missing = FramesReader::Open(folder / "none.bin").status();
  EXPECT_TRUE(absl::IsNotFound(missing));
  EXPECT_NE(missing.message().find("none.bin: cannot be opened"), std::string::npos);
  WriteBytes(folder / "frames.bin",
             EncodeFramesHead(SmallHead()) + EncodeClothFrame(SmallHead(), SmallFrame(1)));
  auto reader = FramesReader::Open(folder / "frames.bin");
  ASSERT_TRUE(reader.ok()) << reader.status();
  const absl::Status before = reader->Read(-1).status();
  EXPECT_TRUE(absl::IsOutOfRange(before));
  EXPECT_NE(before.message().find("holds frames 0 to 0, not -1"), std::string::npos) << before;
  EXPECT_EQ(reader->Read(0)->time_ns, 40'000'000);
  // It became shorter since.
  std::filesystem::resize_file(folder / "frames.bin", std::filesystem::file_size(folder / "frames.bin") - 1);
  const absl::Status cut = reader->Read(0).status();
  EXPECT_TRUE(absl::IsDataLoss(cut)) << cut;
  EXPECT_NE(cut.message().find("frame 0 cannot be read"), std::string::npos) << cut;
}

}  // namespace
}  // namespace weft
