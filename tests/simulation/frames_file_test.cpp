#include "services/formats/synthetic/frames_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "figure/motion_generator.h"
#include "services/formats/synthetic/cloth_writer.h"
#include "simulation/take_presets.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using Eigen::Vector3d;

FramesHead Head() { return {"0123456789abcdef", 3, 25, true}; }

ClothFrame Frame(double size_mm) {
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
    const ClothFrame frame = Frame(size_mm);
    const std::string bytes = EncodeClothFrame(Head(), frame);
    EXPECT_EQ(bytes.size(), ClothFrameBytes(Head()));
    const absl::StatusOr<ClothFrame> read = DecodeClothFrame(Head(), bytes, "frames.bin");
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
  std::string bytes = EncodeClothFrame(Head(), Frame(10));
  bytes[50] = static_cast<char>(bytes[50] ^ 4);
  const absl::StatusOr<ClothFrame> read = DecodeClothFrame(Head(), bytes, "frames.bin: frame 3");
  EXPECT_EQ(read.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(read.status().message().find("frames.bin: frame 3"), std::string::npos);
  std::string head = EncodeFramesHead(Head());
  EXPECT_EQ(DecodeFramesHead(head, "frames.bin")->template_hash, Head().template_hash);
  head[12] = static_cast<char>(head[12] ^ 4);
  EXPECT_NE(DecodeFramesHead(head, "frames.bin").status().message().find("checksum"), std::string::npos);
  EXPECT_NE(DecodeFramesHead("ply\n", "frames.bin").status().message().find("weftseq1"), std::string::npos);
}

TEST(FramesFile, AnyFrameIsReadAndACutOffOneIsSeen) {
  const TempFolder folder;
  std::string bytes = EncodeFramesHead(Head());
  for (const double size_mm : {1.0, 2.0, 3.0}) bytes += EncodeClothFrame(Head(), Frame(size_mm));
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

SyntheticTakeOptions WornTake(int frames) {
  SyntheticTakeOptions options = *SyntheticPreset("tshirt-24", 1);
  options.performance.cell_mm = 20, options.performance.settle_s = 0.1;
  options.performance.frames = frames;
  options.performance.clip = std::make_shared<const Motion>(*MakeMotion({MotionKind::kSpline, 2, 60, 3}));
  return options;
}

TEST(ClothWriter, AStoppedTakeGoesOnToTheSameBytes) {
  const TempFolder folder;
  const SyntheticTakeOptions options = WornTake(6);
  {
    const absl::StatusOr<TakeFolder> whole = TakeFolder::Open(folder / "whole", "recipe");
    const absl::StatusOr<ClothSummary> done = WriteClothTake(options, *whole);
    ASSERT_TRUE(done.ok()) << done.status();
    EXPECT_EQ(done->frames, 6);
    EXPECT_EQ(done->intersecting_frames, 0);
    EXPECT_TRUE(whole->IsComplete());
  }
  const absl::StatusOr<TakeFolder> parts = TakeFolder::Open(folder / "parts", "recipe");
  std::stop_source stop;
  const auto stop_after = [&](int frames) {
    return [&stop, frames](int done) {
      if (done >= frames) stop.request_stop();
    };
  };
  EXPECT_EQ(WriteClothTake(options, *parts, {}, stop_after(2), stop.get_token()).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_FALSE(parts->IsComplete());
  // Bytes of a frame that was not saved are dropped.
  std::filesystem::resize_file(parts->FramesFile() + ".part",
                               std::filesystem::file_size(parts->FramesFile() + ".part") + 77);
  bool dressed = false;
  const absl::StatusOr<ClothSummary> rest = WriteClothTake(options, *parts, [&](double) { dressed = true; });
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(rest->resumed_at, 2);
  EXPECT_FALSE(dressed);
  EXPECT_EQ(ReadBytes(folder / "whole/truth/frames.bin"), ReadBytes(folder / "parts/truth/frames.bin"));
  EXPECT_FALSE(std::filesystem::exists(parts->FramesFile() + ".state"));

  // What the file holds: the cloth moves, and the person's pose with it.
  absl::StatusOr<FramesReader> reader = FramesReader::Open(folder / "whole/truth/frames.bin");
  ASSERT_TRUE(reader.ok()) << reader.status();
  const ClothFrame first = *reader->Read(0), last = *reader->Read(5);
  EXPECT_NEAR(static_cast<double>(last.time_ns), 5e9 / options.performance.fps, 1);
  EXPECT_GT((last.vertices_mm[0] - first.vertices_mm[0]).norm(), 0.5);
  EXPECT_GT(first.pose->Of(Joint::kChest).angularDistance(last.pose->Of(Joint::kChest)), 1e-3);
}

TEST(ClothWriter, ADamagedStateOnlyCostsTime) {
  const TempFolder folder;
  const SyntheticTakeOptions options = WornTake(2);
  const absl::StatusOr<TakeFolder> take = TakeFolder::Open(folder / "take", "recipe");
  std::stop_source stop;
  (void)WriteClothTake(
      options, *take, {}, [&](int) { stop.request_stop(); }, stop.get_token());
  std::string state = ReadBytes(take->FramesFile() + ".state");
  ASSERT_GT(state.size(), 1000u);
  state[500] = static_cast<char>(state[500] ^ 1);
  WriteBytes(take->FramesFile() + ".state", state);
  const absl::StatusOr<ClothSummary> done = WriteClothTake(options, *take);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->resumed_at, 0);
  EXPECT_EQ(FramesReader::Open(take->FramesFile())->frames(), 2);
}

}  // namespace
}  // namespace weft
