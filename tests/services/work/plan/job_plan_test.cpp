#include "services/work/plan/job_plan.h"

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
  pilot.startup_core_s = 0.4;
  pilot.frame_s = {3, 3};
  pilot.frame_core_s = 2.9;
  pilot.peak_memory_mib = 400;
  pilot.mib_read_per_frame = 90;
  pilot.mib_written_per_frame = 10;
  return pilot;
}

TEST(PilotRuns, AreNeighboursSpreadEvenly) {
  EXPECT_THAT(PilotRuns(100, 10),
              ElementsAre(ElementsAre(22, 23, 24, 25, 26), ElementsAre(72, 73, 74, 75, 76)));
  EXPECT_THAT(PilotRuns(3, 20), ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_THAT(PilotRuns(0, 20), IsEmpty());
  const std::vector<std::vector<size_t>> many = PilotRuns(1800, 20);
  EXPECT_EQ(many.size(), 4u);
  for (const std::vector<size_t>& run : many) EXPECT_EQ(run.size(), 5u);
  EXPECT_LT(many.back().back(), 1800u);
}

// What a worker of one thread has taken after so much work, so much waiting for files, and so much waiting
// for a core that somebody else had.
v1::WorkerUsage Usage(double core_s, double files_s, double delay_s) {
  v1::WorkerUsage usage;
  usage.set_core_s(core_s);
  usage.set_delay_s(delay_s);
  usage.set_wall_s(core_s + files_s + delay_s);
  return usage;
}

// Two seconds to start. Frames of 3 s, and half a second more from the third on, and a tenth for files.
PilotTask TaskOn(double delay_per_core_s) {
  PilotTask task;
  double core_s = 2, files_s = 0;
  for (int frame = 0; frame < 5; ++frame) {
    core_s += frame < 2 ? 3 : 3.5;
    files_s += 0.1;
    task.finished.push_back(Usage(core_s, files_s, core_s * delay_per_core_s));
  }
  task.ended = task.finished.back();
  return task;
}

TEST(PilotFrom, LeavesOutWhatOtherWorkTookOfTheMachine) {
  for (const double load : {0.0, 3.0}) {
    const Pilot pilot = PilotFrom({TaskOn(load), TaskOn(load)});
    EXPECT_EQ(pilot.frame_s.size(), 6u);
    for (const double s : pilot.frame_s) EXPECT_NEAR(s, 3.6, 1e-9) << load;
    EXPECT_NEAR(pilot.frame_core_s, 3.5, 1e-9);
    EXPECT_NEAR(pilot.startup_s, 2, 1e-9);
    EXPECT_NEAR(pilot.startup_core_s, 2, 1e-9);
  }
  EXPECT_EQ(PilotFrom({TaskOn(0)}).waited_share, 0);
  EXPECT_GT(PilotFrom({TaskOn(3)}).waited_share, 0.7);
}

TEST(PilotFrom, UsesAllThatShortTasksHave) {
  PilotTask task = TaskOn(0);
  task.finished.resize(2);
  EXPECT_THAT(PilotFrom({task}).frame_s, ElementsAre(testing::DoubleNear(3.1, 1e-9)));
  task.finished.resize(1);
  EXPECT_THAT(PilotFrom({task}).frame_s, ElementsAre(testing::DoubleNear(5.1, 1e-9)));
}

TEST(PlanJob, OneCoreRunsOneFrameAfterAnother) {
  PlanRequest request;
  request.frames_per_task = 10;
  const auto plan = PlanJob(PilotOf(100), request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->tasks(), 10);
  EXPECT_NEAR(plan->wall_s(), 10 * (10 * 3 + 1), 1e-6);
  // Between two tasks the core is nobody's.
  EXPECT_NEAR(plan->core_hours(), (plan->wall_s() - 10 * 0.5) / 3600, 1e-9);
  EXPECT_NEAR(plan->processor_hours(), (100 * 2.9 + 10 * 0.4) / 3600, 1e-9);
  EXPECT_EQ(plan->memory_mib(), 500);
  EXPECT_NEAR(plan->gib_read() * 1024, 9000, 1e-6);
  EXPECT_THAT(plan->limited_by(), HasSubstr("the cores"));
}

TEST(PlanJob, SlowerCoresLengthenWorkAndNotTheWaitingForFiles) {
  PlanRequest request;
  request.frames_per_task = 10;
  request.core_speed = 0.5;
  const auto plan = PlanJob(PilotOf(100), request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_NEAR(plan->wall_s(), 10 * (10 * (2 * 2.9 + 0.1) + (2 * 0.4 + 0.1) + 0.5), 1e-6);
  EXPECT_NEAR(plan->processor_hours(), (100 * 2.9 + 10 * 0.4) / 3600, 1e-9);
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
