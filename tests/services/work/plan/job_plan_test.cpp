#include "services/work/plan/job_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

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

// Tasks of one frame that start at once, each on a core of its own.
PlanRequest AtOnce(int cores) {
  PlanRequest request;
  request.cores = cores;
  request.frames_per_task = 1;
  request.starts_per_s = 0;
  return request;
}

TEST(PlanJob, GivesEachTaskTheThreadsOfThePilot) {
  Pilot pilot = PilotOf(40);
  pilot.threads = 2;
  PlanRequest request = AtOnce(9);  // one is left over
  request.frames_per_task = 10;
  const auto plan = PlanJob(pilot, request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->cpus_per_task(), 2);
  EXPECT_EQ(plan->tasks(), 4);
  EXPECT_NEAR(plan->wall_s(), 31, 1e-9);
  EXPECT_NEAR(plan->core_hours(), 4 * 30.5 * 2 / 3600, 1e-9);
  EXPECT_NEAR(plan->use(), 1, 1e-9);
  EXPECT_EQ(plan->limited_by(), "the cores: they work 100 % of the time");
}

TEST(PlanJob, NodesThatCoresDoNotDivideAreALittleSmaller) {
  PlanRequest request = AtOnce(10);
  request.cores_per_node = 4;  // three nodes of three
  EXPECT_NEAR(PlanJob(PilotOf(10), request)->wall_s(), 2 * 4, 1e-9);
  EXPECT_NEAR(PlanJob(PilotOf(10), request)->use(), 10.0 / 18, 1e-9);
  request.cores_per_node = 5;
  EXPECT_NEAR(PlanJob(PilotOf(10), request)->wall_s(), 4, 1e-9);
}

TEST(PlanJob, TellsWhatThePilotMeasured) {
  Pilot pilot = PilotOf(7);
  pilot.frame_s = {2, 5, 3.5};
  pilot.peak_memory_mib = 401;
  pilot.waited_share = 0.25;
  PlanRequest request;
  request.frames_per_task = 3;
  const auto plan = PlanJob(pilot, request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->frames(), 7);
  EXPECT_EQ(plan->cores(), 1);
  EXPECT_EQ(plan->frames_per_task(), 3);
  EXPECT_EQ(plan->tasks(), 3);
  EXPECT_EQ(plan->memory_mib(), 502);  // a quarter more, upwards
  EXPECT_NEAR(plan->gib_written(), 70.0 / 1024, 1e-12);
  const v1::JobPilot& told = plan->pilot();
  EXPECT_EQ(told.frames_registered(), 3);
  EXPECT_EQ(told.threads(), 1);
  EXPECT_EQ(told.startup_s(), 0.5);
  EXPECT_EQ(told.startup_core_s(), 0.4);
  EXPECT_NEAR(told.frame_s(), 3.5, 1e-12);
  EXPECT_EQ(told.frame_core_s(), 2.9);
  EXPECT_EQ(told.longest_frame_s(), 5);
  EXPECT_EQ(told.peak_memory_mib(), 401);
  EXPECT_EQ(told.mib_read_per_frame(), 90);
  EXPECT_EQ(told.mib_written_per_frame(), 10);
  EXPECT_EQ(told.waited_share(), 0.25);
}

TEST(PlanJob, LongerTasksThanTheJobHaveAllItsFrames) {
  PlanRequest request;
  request.frames_per_task = 50;
  EXPECT_EQ(PlanJob(PilotOf(7), request)->frames_per_task(), 7);
  EXPECT_EQ(PlanJob(PilotOf(7), request)->tasks(), 1);
}

// One core starts as few workers as it can.
TEST(PlanJob, ChoosesAmongTasksUpToAllFrames) {
  const auto plan = PlanJob(PilotOf(100), PlanRequest());
  EXPECT_EQ(plan->frames_per_task(), 100);
  EXPECT_NEAR(plan->wall_s(), 301, 1e-9);
  EXPECT_EQ(PlanJob(PilotOf(1), PlanRequest())->frames_per_task(), 1);
}

TEST(PlanJob, SaysWhatLimitsItInFigures) {
  EXPECT_EQ(PlanJob(PilotOf(6), AtOnce(4))->limited_by(),
            "the last tasks: cores work 75 % of the time, since tasks of 4 s end unevenly");
  EXPECT_EQ(PlanJob(PilotOf(17), AtOnce(4))->limited_by(), "the cores: they work 85 % of the time");
  EXPECT_EQ(PlanJob(PilotOf(4), AtOnce(4))->limited_by(), "the cores: they work 100 % of the time");
  Pilot pilot = PilotOf(20);
  pilot.threads = 2;
  EXPECT_EQ(PlanJob(pilot, AtOnce(64))->limited_by(),
            "the number of tasks: 20 tasks leave 24 of 64 cores idle");
  PlanRequest request = AtOnce(1000);
  request.starts_per_s = 2;
  EXPECT_EQ(PlanJob(PilotOf(100), request)->limited_by(),
            "the scheduler: 100 tasks at 2.0 starts a second take 50 s");
  request.cores = 100;
  request.frames_per_task = 10;
  request.shared_mib_per_s = 100;
  EXPECT_EQ(PlanJob(PilotOf(1000), request)->limited_by(),
            "the shared file system: 97.7 GiB at 100 MiB/s take 1000 s");
  request.shared_mib_per_s = 10'000;  // takes 10 s
  EXPECT_EQ(PlanJob(PilotOf(1000), request)->limited_by(),
            "the scheduler: 100 tasks at 2.0 starts a second take 50 s");
}

TEST(PlanJob, RowsOfOtherCoresLeaveOutThoseTooFewForATask) {
  Pilot pilot = PilotOf(12);
  pilot.threads = 2;
  PlanRequest request = AtOnce(4);
  request.frames_per_task = 3;
  request.other_cores = {1, 2, 8};
  const auto plan = PlanJob(pilot, request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  ASSERT_EQ(plan->other_cores_size(), 2);
  EXPECT_EQ(plan->other_cores(0).cores(), 2);
  EXPECT_NEAR(plan->other_cores(0).wall_s(), 4 * 10, 1e-9);
  const v1::JobPlanRow& row = plan->other_cores(1);
  EXPECT_EQ(row.cores(), 8);
  EXPECT_EQ(row.frames_per_task(), 3);
  EXPECT_NEAR(row.wall_s(), 10, 1e-9);
  EXPECT_NEAR(row.core_hours(), 4 * 9.5 * 2 / 3600, 1e-9);
  EXPECT_NEAR(row.processor_hours(), (12 * 2.9 + 4 * 0.4) / 3600, 1e-9);
  EXPECT_NEAR(row.use(), 1, 1e-9);
}

TEST(PlanJob, NeedsAPilotWithAFrame) {
  Pilot pilot = PilotOf(10);
  pilot.frame_s.clear();
  EXPECT_TRUE(absl::IsInvalidArgument(PlanJob(pilot, {}).status()));
  pilot = PilotOf(0);
  EXPECT_TRUE(absl::IsInvalidArgument(PlanJob(pilot, {}).status()));
  pilot = PilotOf(10);
  pilot.threads = 0;
  EXPECT_EQ(PlanJob(pilot, {}).status().message(), "pilot: has no frame");
  pilot.threads = 2;
  EXPECT_EQ(PlanJob(pilot, {}).status().message(), "cores: 1, but a task has 2 (--cpus-per-task)");
}

TEST(PlanRequest, EveryFieldHasItsLimits) {
  const auto why_not = [](auto&& change) {
    PlanRequest request;
    change(request);
    return std::string(request.Validate().message());
  };
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(why_not([](PlanRequest& r) { r.cores = 1'000'000; }), "");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.cores = 1'000'001; }), "cores: 1e+06 is out of range");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.frames_per_task = -1; }), "frames_per_task: -1 is out of range");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.cores_per_node = 1; }), "");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.cores_per_node = 0; }), "cores_per_node: 0 is out of range");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.other_cores = {1, 1'000'000}; }), "");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.other_cores = {1, 0}; }), "other_cores: 0 is out of range");
  EXPECT_THAT(why_not([](PlanRequest& r) { r.other_cores = {1'000'001}; }), HasSubstr("other_cores"));
  EXPECT_EQ(why_not([](PlanRequest& r) { r.launch_s = 0; }), "");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.launch_s = -1; }), "launch_s: -1 is out of range");
  EXPECT_EQ(why_not([&](PlanRequest& r) { r.launch_s = inf; }), "launch_s: inf is out of range");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.core_speed = 0; }), "core_speed: 0 is out of range");
  EXPECT_EQ(why_not([&](PlanRequest& r) { r.core_speed = inf; }), "core_speed: inf is out of range");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.starts_per_s = -1; }), "starts_per_s: -1 is out of range");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.shared_mib_per_s = -1; }), "shared_mib_per_s: -1 is out of range");
  EXPECT_EQ(why_not([](PlanRequest& r) { r.hours_between_losses = -1; }),
            "hours_between_losses: -1 is out of range");
}

TEST(JobPlanText, SaysEverythingOnLinesOfItsOwn) {
  v1::JobPlan plan;
  v1::JobPilot& pilot = *plan.mutable_pilot();
  pilot.set_frames_registered(6), pilot.set_threads(2);
  pilot.set_frame_s(3.25), pilot.set_longest_frame_s(4.5), pilot.set_frame_core_s(6.125);
  pilot.set_startup_s(0.75);
  plan.set_frames(1800), plan.set_tasks(180), plan.set_frames_per_task(10), plan.set_cores(64);
  plan.set_cpus_per_task(2), plan.set_wall_s(119.4), plan.set_core_hours(3.5), plan.set_memory_mib(502);
  plan.set_gib_read(158.25), plan.set_gib_written(17.5), plan.set_limited_by("the cores");
  const auto add = [&](int cores, double wall_s) {
    v1::JobPlanRow& row = *plan.add_other_cores();
    row.set_cores(cores), row.set_wall_s(wall_s), row.set_core_hours(4.25), row.set_frames_per_task(5);
    row.set_use(0.93);
  };
  add(8, 120);
  add(4, 7199);
  add(2, 7200);
  const std::string pilot_line =
      "pilot       6 frames with 2 threads: 3.25 s a frame, 4.50 s at most, 6.12 core-seconds; 0.75 s to "
      "start\n";
  const std::string rest =
      "frames      1800\n"
      "tasks       180 of 10 frames\n"
      "wall time   119 s on 64 cores\n"
      "core-hours  3.50\n"
      "memory      502 MiB a task\n"
      "files       158.25 GiB read, 17.50 GiB written\n"
      "limited by  the cores\n"
      "     8 cores  2 min, 4.25 core-hours, tasks of 5 frames, 93 % used\n"
      "     4 cores  120 min, 4.25 core-hours, tasks of 5 frames, 93 % used\n"
      "     2 cores  2.0 h, 4.25 core-hours, tasks of 5 frames, 93 % used\n"
      "options     weftd --slurm-frames-per-task 10 --slurm-cpus-per-task 2 --slurm-memory-mib 502\n";
  pilot.set_waited_share(0.1);
  EXPECT_EQ(JobPlanText(plan), pilot_line + rest);
  pilot.set_waited_share(0.25);
  EXPECT_EQ(JobPlanText(plan),
            pilot_line + "            other work had its cores 25 % of the time, which is left out\n" + rest);
}

}  // namespace
}  // namespace weft
