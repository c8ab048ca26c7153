#include "services/plan/job_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Frames of 3 s that start 0.5 s after their worker, and whose worker starts 0.5 s after the last one.
Pilot PilotOf(int job_frames) {
  Pilot pilot;
  pilot.job_frames = job_frames;
  pilot.startup_s = 0.5;
  pilot.frame_s = {3, 3};
  pilot.frame_core_s = 2.9;
  pilot.peak_memory_mib = 400;
  pilot.mib_read_per_frame = 90;
  pilot.mib_written_per_frame = 10;
  return pilot;
}

TEST(PilotFrames, AreRunsOfNeighboursSpreadEvenly) {
  EXPECT_THAT(PilotFrames(100, 8), ElementsAre(23, 24, 25, 26, 73, 74, 75, 76));
  EXPECT_THAT(PilotFrames(3, 20), ElementsAre(0, 1, 2));
  EXPECT_THAT(PilotFrames(0, 20), IsEmpty());
  const std::vector<size_t> many = PilotFrames(1800, 20);
  EXPECT_EQ(many.size(), 20u);
  EXPECT_TRUE(std::is_sorted(many.begin(), many.end()));
  EXPECT_LT(many.back(), 1800u);
}

TEST(PlanJob, OneCoreRunsOneFrameAfterAnother) {
  PlanRequest request;
  request.frames_per_task = 10;
  const auto plan = PlanJob(PilotOf(100), request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->tasks(), 10);
  EXPECT_NEAR(plan->wall_s(), 10 * (10 * 3 + 1), 1e-6);
  EXPECT_NEAR(plan->core_hours(), plan->wall_s() / 3600, 1e-9);
  EXPECT_EQ(plan->memory_mib(), 500);
  EXPECT_NEAR(plan->gib_read() * 1024, 9000, 1e-6);
  EXPECT_THAT(plan->limited_by(), HasSubstr("the cores"));
}

TEST(PlanJob, ChoosesLongTasksWhereStartsAreDear) {
  PlanRequest request;
  request.cores = 1000;
  const auto plan = PlanJob(PilotOf(18000), request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  // Alone, 18 frames of 3 s take 54 s; 1,000 tasks of 18 frames take 500 s to start at 2 a second.
  EXPECT_GE(plan->frames_per_task(), 18);
  EXPECT_GT(plan->wall_s(), 54);
  EXPECT_THAT(plan->limited_by(), HasSubstr("the scheduler"));
  request.starts_per_s = 1000;
  EXPECT_LT(PlanJob(PilotOf(18000), request)->wall_s(), 80);
}

TEST(PlanJob, NamesASlowFileSystem) {
  PlanRequest request;
  request.cores = 100;
  request.shared_mib_per_s = 100;  // one frame a second
  const auto plan = PlanJob(PilotOf(1000), request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_THAT(plan->limited_by(), HasSubstr("the shared file system"));
  EXPECT_GE(plan->wall_s(), 999);
}

TEST(PlanJob, NamesCoresThatHaveNoTask) {
  PlanRequest request;
  request.cores = 64;
  request.starts_per_s = 100;
  const auto plan = PlanJob(PilotOf(20), request);
  EXPECT_THAT(plan->limited_by(), HasSubstr("20 tasks leave 44 of 64 cores idle"));
}

TEST(PlanJob, ComparesOtherNumbersOfCores) {
  PlanRequest request;
  request.cores = 4;
  request.other_cores = {8};
  const auto plan = PlanJob(PilotOf(1000), request);
  ASSERT_EQ(plan->other_cores_size(), 1);
  EXPECT_LT(plan->other_cores(0).wall_s(), plan->wall_s() * 0.6);
  EXPECT_THAT(JobPlanText(*plan), HasSubstr("8 cores"));
}

TEST(PlanJob, RefusesWhatCannotBe) {
  PlanRequest request;
  request.cores = 0;
  EXPECT_THAT(std::string(PlanJob(PilotOf(10), request).status().message()), HasSubstr("cores: 0"));
  request.cores = 1;
  Pilot pilot = PilotOf(10);
  pilot.threads = 4;
  EXPECT_TRUE(absl::IsFailedPrecondition(PlanJob(pilot, request).status()));
}

}  // namespace
}  // namespace weft
