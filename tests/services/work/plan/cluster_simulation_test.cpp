#include "services/work/plan/cluster_simulation.h"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace weft
