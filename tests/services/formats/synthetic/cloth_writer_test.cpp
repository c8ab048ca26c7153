#include "services/formats/synthetic/cloth_writer.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "figure/motion_generator.h"
#include "services/formats/synthetic/frames_file.h"
#include "simulation/take_presets.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(ClothWriter, TornClothIsToldFromWornCloth) {
  TriangleMesh rest = {{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {10, 10, 0}}, {{0, 1, 2}, {1, 3, 2}}};
  EXPECT_EQ(MedianStretch(rest, rest.vertices_mm), 0);
  // Turned and folded along the diagonal: no edge changes.
  std::vector<Eigen::Vector3d> folded = rest.vertices_mm;
  folded[3] = folded[0];
  EXPECT_NEAR(MedianStretch(rest, folded), 0, 1e-12);
  for (const double scale : {0.7, 1.3}) {
    std::vector<Eigen::Vector3d> torn = rest.vertices_mm;
    for (Eigen::Vector3d& p : torn) p *= scale;
    EXPECT_NEAR(MedianStretch(rest, torn), 0.3, 1e-12);
  }
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
