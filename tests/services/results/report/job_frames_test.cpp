#include "services/results/report/job_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/status/status.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(JobFrames, LeavesOutWithANoteWhatIsNotOfTheJob) {
  const TempFolder folder;
  WriteBytes(folder / "10/report.json", "{\"frame\": \"another name\"}");
  WriteBytes(folder / "2/report.json", R"({"inputs": {"rig": "aa"}})");
  WriteBytes(folder / "3/report.json", "{");
  WriteBytes(folder / "4/report.json", R"({"inputs": {"rig": "bb"}})");
  WriteBytes(folder / "11/report.json", "{}");
  v1::Job job;
  job.set_first_frame("2");
  job.set_last_frame("10");
  job.mutable_inputs()->set_rig("aa");
  std::vector<std::string> notes;
  const auto frames = ReadJobFrames(folder.path(), job, notes);
  ASSERT_TRUE(frames.ok()) << frames.status();
  ASSERT_EQ(frames->size(), 2u);
  EXPECT_EQ((*frames)[0].frame(), "2");
  EXPECT_EQ((*frames)[1].frame(), "10");
  EXPECT_THAT(notes, ElementsAre(HasSubstr("Frame 3 is missing from this report"),
                                 HasSubstr("1 frame in the folder were computed from another rig"),
                                 HasSubstr("1 frame that this job was not asked for")));
}

TEST(JobFrames, OlderJobsWereAskedForEveryFrame) {
  const TempFolder folder;
  WriteBytes(folder / "7/report.json", "{}");
  std::vector<std::string> notes;
  const auto frames = ReadJobFrames(folder.path(), {}, notes);
  ASSERT_TRUE(frames.ok()) << frames.status();
  EXPECT_EQ(frames->size(), 1u);
  EXPECT_TRUE(notes.empty());
  EXPECT_TRUE(absl::IsNotFound(ReadJobFrames(folder / "gone", {}, notes).status()));
}

}  // namespace
}  // namespace weft
