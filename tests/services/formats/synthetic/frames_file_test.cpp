#include "services/formats/synthetic/frames_file.h"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace weft
