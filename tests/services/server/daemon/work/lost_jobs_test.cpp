#include "services/server/daemon/work/lost_jobs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LostJobsTest : public ::testing::Test {
 protected:
  LostJobsTest() {
    std::filesystem::create_directories(results_);
    auto opened = Catalogue::Open(folder_ / "catalogue.sqlite");
    EXPECT_TRUE(opened.ok()) << opened.status();
    catalogue_ = *std::move(opened);
  }

  TempFolder folder_;
  const std::string results_ = std::filesystem::canonical(folder_.path()).string() + "/results";
  std::unique_ptr<Catalogue> catalogue_;
};

TEST_F(LostJobsTest, AreTakenUpFromTheirResultsOnce) {
  WriteBytes(results_ + "/one/job.json", "{\"id\": \"one\", \"state\": \"JOB_STATE_DONE\"}");
  WriteBytes(results_ + "/one/0001/report.json", "{\"frame\": \"0001\", \"state\": \"FRAME_STATE_DONE\"}");
  EXPECT_THAT(TakeUpLostJobs(results_, *catalogue_), ElementsAre(HasSubstr("from their job.json: one")));
  const auto job = catalogue_->ReadJob("one");
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_DONE);
  const auto frames = catalogue_->ReadFrames("one");
  ASSERT_TRUE(frames.ok());
  ASSERT_EQ(frames->size(), 1u);
  EXPECT_EQ(frames->front().frame(), "0001");
  EXPECT_THAT(TakeUpLostJobs(results_, *catalogue_), IsEmpty());
}

// Whoever copies a folder makes no second job, and what is being removed does not come back.
TEST_F(LostJobsTest, AreNamedWhereNothingSaysWhatTheyWere) {
  WriteBytes(results_ + "/copy/job.json", "{\"id\": \"one\"}");
  WriteBytes(results_ + "/torn/job.json", "{\"id\": \"to");
  std::filesystem::create_directories(results_ + "/bare");
  WriteBytes(results_ + "/" + kForgottenPrefix + "old/job.json", "{\"id\": \"old\"}");
  EXPECT_THAT(TakeUpLostJobs(results_, *catalogue_), ElementsAre(HasSubstr(": bare, copy, torn; copy what")));
  EXPECT_EQ(catalogue_->ReadJob("one").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(LostJobsTest, AreFiveAtTheMostByName) {
  for (int i = 1; i <= 7; ++i) std::filesystem::create_directories(results_ + "/j" + std::to_string(i));
  EXPECT_THAT(TakeUpLostJobs(results_, *catalogue_), ElementsAre(HasSubstr("j1, j2, j3, j4, j5 and 2 more")));
}

TEST_F(LostJobsTest, AreNoneWithoutResults) {
  EXPECT_THAT(TakeUpLostJobs(folder_ / "missing", *catalogue_), IsEmpty());
}

}  // namespace
}  // namespace weft
