#include "services/formats/synthetic/dataset_writer.h"

#include <gtest/gtest.h>

#include "services/formats/synthetic/dataset_file.h"
#include "services/formats/synthetic/frames_file.h"
#include "services/formats/synthetic/take_folder.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

DatasetPreset ThreeTakes() {
  DatasetPreset preset = *DatasetPresetNamed("tiny-drive");
  preset.takes = {{DatasetSplit::kTrain, MotionKind::kWalk, 1, 4},
                  {DatasetSplit::kTestUnseen, MotionKind::kSquat, 2, 3},
                  {DatasetSplit::kChaos, MotionKind::kWalk, 1, 4}};
  return preset;
}

std::string FramesOf(const TempFolder& folder, const std::string& set, const std::string& take) {
  return ReadBytes(folder / (set + "/takes/" + take + "/truth/frames.bin"));
}

TEST(DatasetWriter, StopsAndGoesOnToTheSameBytes) {
  const TempFolder folder;
  const DatasetPreset preset = ThreeTakes();
  const absl::StatusOr<DatasetSummary> whole = MakeDataset(preset, folder / "whole", 0);
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_EQ(whole->complete, 3);
  EXPECT_EQ(whole->frames, 11);

  // Time is over after each frame.
  int calls = 0;
  absl::StatusOr<DatasetSummary> parts;
  do {
    parts = MakeDataset(preset, folder / "parts", 1e-9);
    ASSERT_TRUE(parts.ok()) << parts.status();
    ASSERT_LT(++calls, 20);
  } while (parts->complete < 3);
  EXPECT_GT(calls, 5);
  for (const DatasetTake& take : preset.takes)
    EXPECT_EQ(FramesOf(folder, "whole", take.Name()), FramesOf(folder, "parts", take.Name())) << take.Name();

  // The record is the same, and knows its files.
  EXPECT_EQ(ReadBytes(folder / "whole/dataset.json"), ReadBytes(folder / "parts/dataset.json"));
  const absl::StatusOr<v1::Dataset> record = ReadDatasetFile(folder / "whole");
  ASSERT_TRUE(record.ok()) << record.status();
  ASSERT_EQ(record->takes_size(), 3);
  EXPECT_EQ(record->takes(1).name(), "test-unseen-squat-2");
  EXPECT_NEAR(record->takes(2).step_ms(), 0.9 * record->takes(0).step_ms(), 1e-9);
  EXPECT_EQ(record->body().waist_girth(), 1);
  EXPECT_TRUE(CheckDatasetFrames(*record, folder / "whole").ok());
  // Four frames are over before the floor is measured.
  EXPECT_TRUE(MeasureFloor(*record, folder / "whole")->empty());
  std::string damaged = FramesOf(folder, "parts", "train-walk-1");
  damaged[damaged.size() / 2] ^= 1;
  WriteBytes(folder / "parts/takes/train-walk-1/truth/frames.bin", damaged);
  const absl::Status check = CheckDatasetFrames(*record, folder / "parts");
  EXPECT_EQ(check.code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(check.message().find("train-walk-1"), std::string::npos);

  // All takes begin alike; chaos then goes its own way.
  const auto frame = [&](const std::string& take, int k) {
    return FramesReader::Open(folder / ("whole/takes/" + take + "/truth/frames.bin"))->Read(k)->vertices_mm;
  };
  EXPECT_EQ(frame("train-walk-1", 0), frame("test-unseen-squat-2", 0));
  EXPECT_EQ(frame("train-walk-1", 0), frame("chaos-walk-1", 0));
  EXPECT_NE(frame("train-walk-1", 3), frame("chaos-walk-1", 3));
  EXPECT_NE(frame("train-walk-1", 2), frame("test-unseen-squat-2", 2));
}

TEST(DatasetWriter, LeavesOtherProcessesTakesAndOtherFoldersAlone) {
  const TempFolder folder;
  DatasetPreset preset = ThreeTakes();
  preset.takes.resize(2);
  ASSERT_TRUE(MakeDataset(preset, folder / "set", 1e-9).ok());
  {
    const absl::StatusOr<TakeFolder> held =
        TakeFolder::Open(folder / "set/takes/train-walk-1",
                         ReadBytes(folder / "set/takes/train-walk-1/recipe.txt")
                             .substr(0, ReadBytes(folder / "set/takes/train-walk-1/recipe.txt").size() - 1));
    ASSERT_TRUE(held.ok()) << held.status();
    const absl::StatusOr<DatasetSummary> rest = MakeDataset(preset, folder / "set", 0);
    ASSERT_TRUE(rest.ok()) << rest.status();
    EXPECT_EQ(rest->elsewhere, 1);
    EXPECT_EQ(rest->complete, 1);
  }
  WriteBytes(folder / "photos/a.jpg", "x");
  EXPECT_EQ(MakeDataset(preset, folder / "photos", 0).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(MakeDataset(ThreeTakes(), folder / "set", 0).status().code(), absl::StatusCode::kAlreadyExists);
}

}  // namespace
}  // namespace weft
