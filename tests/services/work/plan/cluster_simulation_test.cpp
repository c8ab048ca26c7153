#include "services/work/plan/cluster_simulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace weft {
namespace {

// Frames of 3 s each, so that all times can be worked out by hand.
JobModel Job(int frames, int frames_per_task) {
  return {.frames = frames,
          .frames_per_task = frames_per_task,
          .startup_s = 0,
          .frame_s = {3},
          .mib_per_frame = 0};
}

ClusterModel Cluster(int nodes, int tasks_per_node) {
  return {.nodes = nodes, .tasks_per_node = tasks_per_node, .starts_per_s = 0};
}

TEST(SimulateJob, RunsTasksOneAfterAnotherOnOneCore) {
  JobModel job = Job(10, 4);
  job.startup_s = 1;
  const SimulatedJob done = SimulateJob(Cluster(1, 1), job, 0);
  EXPECT_EQ(done.tasks, 3);
  EXPECT_DOUBLE_EQ(done.wall_s, 10 * 3 + 3 * 1);
  EXPECT_DOUBLE_EQ(done.busy_s, done.wall_s);
  EXPECT_DOUBLE_EQ(done.slots_used, 1);
}

TEST(SimulateJob, LeavesCoresIdleAtTheEnd) {
  // Seven tasks of 6 s on four cores: two rounds, the second with three.
  const SimulatedJob done = SimulateJob(Cluster(2, 2), Job(14, 2), 0);
  EXPECT_DOUBLE_EQ(done.wall_s, 12);
  EXPECT_DOUBLE_EQ(done.busy_s, 42);
  EXPECT_DOUBLE_EQ(done.slots_used, 42.0 / 48);
}

TEST(SimulateJob, IsLimitedByTheStartsOfTasks) {
  ClusterModel cluster = Cluster(10, 10);
  cluster.starts_per_s = 2;
  // The last of 100 tasks starts after 99 half seconds.
  EXPECT_DOUBLE_EQ(SimulateJob(cluster, Job(100, 1), 0).wall_s, 49.5 + 3);
}

TEST(SimulateJob, SharesTheFileSystemAmongRunningTasks) {
  ClusterModel cluster = Cluster(1, 8);
  cluster.shared_mib_per_s = 10;
  JobModel job = Job(80, 10);
  job.mib_per_frame = 15;  // 8 tasks want 40 MiB/s
  EXPECT_NEAR(SimulateJob(cluster, job, 0).wall_s, 80 * 15 / 10.0, 1e-9);
  job.mib_per_frame = 1;
  EXPECT_NEAR(SimulateJob(cluster, job, 0).wall_s, 30, 1e-9);
}

TEST(SimulateJob, DoesAgainWhatIsLostWithNodesAndNoMore) {
  ClusterModel cluster = Cluster(5, 4);
  cluster.hours_between_losses = 0.2;
  cluster.repair_s = 30;
  cluster.notice_s = 10;
  const JobModel job = Job(2000, 20);
  const SimulatedJob undisturbed = SimulateJob(Cluster(5, 4), job, 0);
  int losses = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const SimulatedJob done = SimulateJob(cluster, job, seed);
    losses += done.losses;
    if (done.losses == 0) continue;
    EXPECT_GE(done.wall_s, undisturbed.wall_s);
    // All frames are done, each counted once.
    EXPECT_NEAR(done.busy_s - done.lost_s, 2000 * 3, 1e-6);
    // At most a task for each slot of a lost node.
    EXPECT_LE(done.lost_s, done.losses * 4 * 60.0);
  }
  EXPECT_GT(losses, 10);
}

TEST(SimulateJob, SaysThatTasksNeverEnd) {
  ClusterModel cluster = Cluster(1, 1);
  cluster.hours_between_losses = 1.0 / 3600;
  cluster.repair_s = 0;
  JobModel job = Job(4, 4);
  job.frame_s = {1000};
  EXPECT_TRUE(std::isinf(SimulateJob(cluster, job, 0).wall_s));
}

TEST(SimulateJob, IsTheSameForASeed) {
  ClusterModel cluster = Cluster(3, 2);
  cluster.hours_between_losses = 1;
  JobModel job = Job(500, 5);
  job.frame_s = {1, 2, 7};
  EXPECT_EQ(SimulateJob(cluster, job, 4).wall_s, SimulateJob(cluster, job, 4).wall_s);
  EXPECT_NE(SimulateJob(cluster, job, 4).wall_s, SimulateJob(cluster, job, 5).wall_s);
}

// What one loss costs is known whenever it comes: the task goes on when its loss was noticed and a node is
// there, with the frames that were not complete.
TEST(SimulateJob, ALossCostsTheFrameItWasInAndTheTimeUntilANodeIsBack) {
  ClusterModel cluster = Cluster(1, 1);
  cluster.hours_between_losses = 0.1;
  JobModel job = Job(100, 100);
  job.startup_s = 1;
  int seen = 0;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    for (const bool noticed_first : {true, false}) {
      cluster.notice_s = noticed_first ? 10 : 30;
      cluster.repair_s = noticed_first ? 30 : 10;
      const SimulatedJob done = SimulateJob(cluster, job, seed);
      if (done.losses != 1 || done.tasks != 2) continue;
      ++seen;
      EXPECT_NEAR(done.wall_s - done.busy_s, 30, 1e-9);
      EXPECT_NEAR(done.busy_s - done.lost_s, 301, 1e-9);
      EXPECT_GT(done.lost_s, 0);
      EXPECT_LT(done.lost_s, 4 + 1e-9);
      EXPECT_NEAR(done.slots_used, done.busy_s / done.wall_s, 1e-12);
    }
  }
  EXPECT_GT(seen, 10);
}

TEST(SimulateJob, NodesAreLostAsOftenAsTheModelSays) {
  ClusterModel cluster = Cluster(4, 1);
  cluster.hours_between_losses = 10;
  cluster.repair_s = 0;
  cluster.notice_s = 0;
  JobModel job = Job(400, 100);
  job.frame_s = {3600};
  double losses = 0, node_hours = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const SimulatedJob done = SimulateJob(cluster, job, seed);
    losses += done.losses;
    node_hours += 4 * done.wall_s / 3600;
  }
  EXPECT_NEAR(10 * losses / node_hours, 1, 0.1);
}

TEST(SimulateJob, WithoutFramesTakesNoTime) {
  const SimulatedJob done = SimulateJob(Cluster(1, 1), Job(0, 1), 0);
  EXPECT_EQ(done.wall_s, 0);
  EXPECT_EQ(done.slots_used, 0);
  EXPECT_EQ(done.tasks, 0);
}

TEST(SimulateJob, FramesHaveAllTimesThatWereMeasuredAndNoOther) {
  JobModel job = Job(4000, 1);
  job.frame_s = {1, 2, 7};
  EXPECT_NEAR(SimulateJob(Cluster(1, 1), job, 1).wall_s / 4000, 10.0 / 3, 0.2);
}

TEST(ClusterModel, EveryFieldHasItsLimits) {
  const auto why_not = [](auto&& change) {
    ClusterModel cluster;
    change(cluster);
    return std::string(cluster.Validate().message());
  };
  EXPECT_EQ(why_not([](ClusterModel&) {}), "");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.nodes = 100000; }), "");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.nodes = 100001; }), "nodes: 100001 is out of range");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.nodes = 0; }), "nodes: 0 is out of range");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.tasks_per_node = 1024; }), "");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.tasks_per_node = 1025; }),
            "tasks_per_node: 1025 is out of range");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.tasks_per_node = 0; }), "tasks_per_node: 0 is out of range");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.starts_per_s = 0, c.repair_s = 0, c.notice_s = 0; }), "");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.starts_per_s = INFINITY; }), "starts_per_s: inf is out of range");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.repair_s = -1; }), "repair_s: -1 is out of range");
  EXPECT_EQ(why_not([](ClusterModel& c) { c.notice_s = NAN; }), "notice_s: nan is out of range");
}

}  // namespace
}  // namespace weft
