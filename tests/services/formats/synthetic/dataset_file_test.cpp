#include "services/formats/synthetic/dataset_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(DatasetFile, RefusesWhatLeaks) {
  const auto message = [](const std::string& takes) {
    const absl::StatusOr<v1::Dataset> dataset = ParseDataset("{\"takes\": [" + takes + "]}", "dataset.json");
    return dataset.ok() ? "" : std::string(dataset.status().message());
  };
  const auto take = [](const std::string& split, const std::string& motion, int seed) {
    return "{\"name\": \"" + split + "-" + motion + "-" + std::to_string(seed) + "\", \"split\": \"" + split +
           "\", \"motion\": \"" + motion + "\", \"motion_seed\": \"" + std::to_string(seed) +
           "\", \"frames\": 9}";
  };
  EXPECT_EQ(message(take("train", "walk", 1) + "," + take("test-known", "walk", 2)), "");
  EXPECT_NE(message(take("train", "walk", 1) + "," + take("test-known", "walk", 1)).find("has the motion of"),
            std::string::npos);
  EXPECT_NE(message(take("train", "walk", 1) + "," + take("test-unseen", "walk", 2)).find("is of a class"),
            std::string::npos);
  EXPECT_NE(message(take("chaos", "walk", 1)).find("repeats no take"), std::string::npos);
  EXPECT_NE(message(take("exam", "walk", 1)).find("split \"exam\" is none of"), std::string::npos);
  // Names are folders.
  EXPECT_NE(
      message("{\"name\": \"../../x\", \"split\": \"train\", \"motion\": \"walk\"}").find("should be called"),
      std::string::npos);
  const TempFolder folder;
  EXPECT_EQ(ReadDatasetFile(folder / "set").status().code(), absl::StatusCode::kNotFound);
}

// A take that was not complete has no hash, and nothing of it is checked.
TEST(DatasetFile, NamesTheFramesThatAreMissing) {
  const TempFolder folder;
  v1::Dataset dataset;
  v1::DatasetTake& take = *dataset.add_takes();
  take.set_name("train-walk-1");
  EXPECT_TRUE(CheckDatasetFrames(dataset, folder.path()).ok());
  take.set_frames_hash("0123456789abcdef");
  const absl::Status status = CheckDatasetFrames(dataset, folder.path());
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), AllOf(HasSubstr(folder / "takes/train-walk-1/truth/frames.bin: is missing"),
                                      HasSubstr("make the data set again")));
}

TEST(DatasetFile, AFolderWithoutOneTellsWhatWritesIt) {
  const TempFolder folder;
  EXPECT_THAT(ReadDatasetFile(folder.path()).status().message(), HasSubstr("`weft dataset make` writes it"));
  WriteBytes(folder / "dataset.json", R"({"takes": [], "colour": 1})");
  const absl::Status status = ReadDatasetFile(folder.path()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr(folder / "dataset.json"), HasSubstr("colour")));
}

}  // namespace
}  // namespace weft
