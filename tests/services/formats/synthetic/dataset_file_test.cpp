#include "services/formats/synthetic/dataset_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "capture/file/checksum.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/frames_file.h"
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

// A take and the same motion once more, of a triangle; the second one lies `apart_mm` beside the first.
class DatasetFloorTest : public ::testing::Test {
 protected:
  DatasetFloorTest() {
    garment_.id = "triangle";
    garment_.board_hash = "0123456789abcdef";
    garment_.rest = {{{0, 0, 0}, {2.7, 0, 0}, {0, 2.7, 0}}, {{0, 2, 1}}};
    garment_.node_of_vertex = {{0, 0}, {0, 1}, {1, 0}};
    EXPECT_TRUE(WriteTemplate(folder_ / "takes/train-walk-1/template", garment_).ok());
    dataset_.set_template_hash(garment_.ContentHash());
    Add("train-walk-1", "train", {0, 0, 0, 0});
    Add("chaos-walk-1", "chaos", {8, 0.5, 1, 0.5});
  }
  // Frames at 0.4 s, 0.5 s, ...
  void Add(const std::string& name, const std::string& split, const std::vector<double>& apart_mm,
           int more_vertices = 0) {
    FramesHead head{garment_.ContentHash(), static_cast<uint32_t>(3 + more_vertices), 10, false};
    std::string bytes = EncodeFramesHead(head);
    for (size_t k = 0; k < apart_mm.size(); ++k) {
      ClothFrame frame;
      frame.time_ns = 400'000'000 + static_cast<int64_t>(k) * 100'000'000;
      for (const Eigen::Vector3d& v :
           {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2, 0, 0), Eigen::Vector3d(0, 2, 0)})
        frame.vertices_mm.push_back(v + Eigen::Vector3d(apart_mm[k], 0, 0));
      for (int i = 0; i < more_vertices; ++i) frame.vertices_mm.emplace_back(1, 1, 0);
      bytes += EncodeClothFrame(head, frame);
    }
    WriteBytes(folder_ / ("takes/" + name + "/truth/frames.bin"), bytes);
    v1::DatasetTake& take = *dataset_.add_takes();
    take.set_name(name);
    take.set_split(split);
    take.set_motion("walk");
    take.set_motion_seed(1);
    take.set_frames(static_cast<int>(apart_mm.size()));
    take.set_frames_hash(absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size())));
  }

  const TempFolder folder_;
  Template garment_;
  v1::Dataset dataset_;
};

TEST_F(DatasetFloorTest, IsHowFarTwoRunsOfOneMotionAreApart) {
  EXPECT_TRUE(CheckDatasetFrames(dataset_, folder_.path()).ok());
  const auto floor = MeasureFloor(dataset_, folder_.path());
  ASSERT_TRUE(floor.ok()) << floor.status();
  ASSERT_EQ(floor->size(), 1u);
  EXPECT_EQ((*floor)[0].take, "train-walk-1");
  EXPECT_EQ((*floor)[0].frames, 3);  // from half a second on
  EXPECT_NEAR((*floor)[0].distance_mm.mean, 2.0 / 3, 1e-9);
  EXPECT_NEAR((*floor)[0].normals_deg.mean, 0, 1e-9);
  EXPECT_NEAR((*floor)[0].error_jitter_mm, 1, 1e-9);
  // Takes that are not complete, of other motions or of chaos alone, say nothing.
  v1::Dataset other = dataset_;
  other.mutable_takes(0)->clear_frames_hash();
  EXPECT_TRUE(MeasureFloor(other, folder_.path())->empty());
  other = dataset_;
  other.mutable_takes(1)->clear_frames_hash();
  EXPECT_TRUE(MeasureFloor(other, folder_.path())->empty());
  other = dataset_;
  other.mutable_takes(0)->set_motion("squat");
  EXPECT_TRUE(MeasureFloor(other, folder_.path())->empty());
  other = dataset_;
  other.mutable_takes(0)->set_motion_seed(2);
  EXPECT_TRUE(MeasureFloor(other, folder_.path())->empty());
  other = dataset_;
  other.mutable_takes(0)->set_split("chaos");
  EXPECT_TRUE(MeasureFloor(other, folder_.path())->empty());
}

TEST_F(DatasetFloorTest, TakesOfOtherVerticesDoNotCompare) {
  dataset_.mutable_takes()->RemoveLast();
  Add("chaos-walk-1", "chaos", {0, 0}, 1);
  const absl::Status status = MeasureFloor(dataset_, folder_.path()).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("takes/chaos-walk-1: has 4 vertices, train-walk-1 has 3"));
}

TEST_F(DatasetFloorTest, FramesAreThoseOfTheDataset) {
  const auto why = [&] { return std::string(CheckDatasetFrames(dataset_, folder_.path()).message()); };
  dataset_.mutable_takes(0)->set_frames(5);
  EXPECT_TRUE(absl::IsDataLoss(CheckDatasetFrames(dataset_, folder_.path())));
  EXPECT_THAT(why(), AllOf(HasSubstr("train-walk-1/truth/frames.bin: holds 4 frames of template "),
                           HasSubstr("the data set says 5 of")));
  dataset_.mutable_takes(0)->set_frames(4);
  dataset_.set_template_hash("another");
  EXPECT_THAT(why(), HasSubstr("the data set says 4 of another"));
}

}  // namespace
}  // namespace weft
