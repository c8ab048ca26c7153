#include "services/results/evaluation/listed_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

// Frames by name; nobody looks at their images here.
class FramesByName : public FrameSource {
 public:
  explicit FramesByName(std::vector<std::string> names) : names_(std::move(names)) {}
  const std::vector<std::string>& frame_names() const override { return names_; }
  absl::StatusOr<FrameSet> Read(size_t) const override { return absl::OutOfRangeError("no images"); }
  absl::StatusOr<Frame> ReadView(size_t, size_t) const override { return absl::OutOfRangeError("no images"); }
  absl::StatusOr<std::string> Fingerprint(size_t) const override {
    return absl::OutOfRangeError("no images");
  }
  const std::vector<std::string>& warnings() const override { return warnings_; }

 private:
  std::vector<std::string> names_, warnings_;
};

class ListedFramesTest : public testing::Test {
 protected:
  void WriteFrames(const std::string& folder, const std::vector<std::string>& names,
                   const std::string& file) {
    for (const std::string& name : names)
      WriteBytes(folder_ / absl::StrCat(folder, "/", name, "/", file), "x");
  }

  // "name@position/index in the dump", or the error.
  std::vector<std::string> List(const std::string& truth, const v1::Job& job,
                                const FrameSource* dump = nullptr, const TakeTimes& times = {}) {
    const auto frames =
        ListFrames(folder_ / "result", truth.empty() ? "" : folder_ / truth, job, dump, times);
    if (!frames.ok()) return {std::string(frames.status().message())};
    std::vector<std::string> lines;
    for (const ListedFrame& frame : *frames)
      lines.push_back(absl::StrCat(frame.name, "@", frame.position, "/", frame.dump_index));
    return lines;
  }

  static v1::Job Asked(const std::string& first, const std::string& last) {
    v1::Job job;
    job.mutable_spec();
    job.set_first_frame(first), job.set_last_frame(last);
    return job;
  }

  TempFolder folder_;
};

TEST_F(ListedFramesTest, WithoutMoreThoseOfTheResultWithMeshOrReport) {
  WriteFrames("result", {"9", "10"}, "mesh.ply");
  WriteFrames("result", {"11", "10"}, "report.json");
  WriteFrames("result", {"12"}, "cloud.ply");
  EXPECT_THAT(List("", {}), ElementsAre("9@0/-1", "10@1/-1", "11@2/-1"));
}

TEST_F(ListedFramesTest, PositionsCountWhatIsMissing) {
  WriteFrames("result", {"0", "1", "2", "10"}, "mesh.ply");
  EXPECT_THAT(List("", {}), ElementsAre("0@0/-1", "1@1/-1", "2@2/-1", "10@10/-1"));
}

TEST_F(ListedFramesTest, OfAJobThoseItWasAskedFor) {
  WriteFrames("truth", {"0", "1", "2", "3", "4"}, "mesh.ply");
  WriteFrames("result", {"2", "4"}, "mesh.ply");
  EXPECT_THAT(List("truth", Asked("1", "2")), ElementsAre("1@1/-1", "2@2/-1")) << "4 is of another job";
  EXPECT_EQ(List("truth", {}).size(), 5u) << "nothing tells what was asked";
  // Jobs of earlier versions.
  v1::Job old;
  old.mutable_spec()->set_first_frame(1);
  EXPECT_THAT(List("truth", old), ElementsAre("1@1/-1", "2@2/-1", "3@3/-1", "4@4/-1"));
  old.mutable_spec()->set_end_frame(3);
  EXPECT_THAT(List("truth", old), ElementsAre("1@1/-1", "2@2/-1"));
  old.set_last_frame("1");
  EXPECT_THAT(List("truth", old), ElementsAre("1@1/-1", "2@2/-1")) << "a range has two ends";
}

TEST_F(ListedFramesTest, WithoutATruthThoseOfTheDump) {
  WriteFrames("result", {"1"}, "mesh.ply");
  const FramesByName dump({"0", "1", "2"});
  EXPECT_THAT(List("", Asked("0", "2"), &dump), ElementsAre("0@0/0", "1@1/1", "2@2/2"));
  EXPECT_THAT(List("", {}, &dump), ElementsAre("1@1/1")) << "no job tells that the dump is its own";
}

TEST_F(ListedFramesTest, TheTakeTellsWhenFramesWere) {
  WriteFrames("truth", {"0", "1"}, "mesh.ply");
  WriteFrames("result", {"0"}, "mesh.ply");
  const FramesByName dump({"0", "1", "2"});
  TakeTimes times;
  times.positions = {3, 8};
  EXPECT_THAT(List("truth", {}, &dump, times), ElementsAre("0@3/0", "1@8/1"));
  times.positions = {3};
  EXPECT_THAT(List("truth", {}, &dump, times), ElementsAre("0@3/0", "1@1/1"));
}

// Times of a take say nothing of frames that it lacks, so that names tell of all.
TEST_F(ListedFramesTest, FramesThatTheDumpLacksHaveAPositionByTheirName) {
  WriteFrames("truth", {"0", "1", "2", "7"}, "mesh.ply");
  WriteFrames("result", {"0"}, "mesh.ply");
  const FramesByName dump({"0", "1"});
  TakeTimes times;
  times.positions = {3, 8};
  EXPECT_THAT(List("truth", {}, &dump, times), ElementsAre("0@0/0", "1@1/1", "2@2/-1", "7@7/-1"));
}

// Positions of jobs of earlier versions count frames of the dump, also where a frame before it is known.
TEST_F(ListedFramesTest, RangesOfEarlierVersionsCountTheDumpsFrames) {
  WriteFrames("truth", {"0", "1", "2"}, "mesh.ply");
  WriteFrames("result", {"1"}, "mesh.ply");
  const FramesByName dump({"1", "2"});
  v1::Job old;
  old.mutable_spec()->set_end_frame(1);
  EXPECT_THAT(List("truth", old, &dump), ElementsAre("0@0/-1", "1@1/0"));
}

TEST_F(ListedFramesTest, ATruthOfOtherFramesIsRefused) {
  WriteFrames("truth", {"0", "1"}, "mesh.ply");
  WriteFrames("result", {"7"}, "mesh.ply");
  const std::string begin = folder_ / "truth" + ": has the frames 0 to 1, and none of ";
  const std::string end = " of " + folder_ / "result" + "; give the truth of the take that was registered";
  EXPECT_THAT(List("truth", {}), ElementsAre(begin + "those" + end));
  EXPECT_THAT(List("truth", Asked("7", "9")), ElementsAre(begin + "the frames 7 to 9" + end));
  std::filesystem::remove_all(folder_ / "result/7");
  EXPECT_EQ(List("truth", {}).size(), 2u) << "an empty result lacks all of them";
  EXPECT_THAT(
      List("truth", Asked("7", "9")),
      ElementsAre(folder_ / "result" + ": holds no frames; give the --out folder of `weft register`"));
}

}  // namespace
}  // namespace weft
