#include "services/server/daemon/work/published_jobs.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

v1::Job PublishedJob(const std::string& id, int64_t finished_unix_ns) {
  v1::Job job;
  job.set_id(id);
  job.set_finished_unix_ns(finished_unix_ns);
  return job;
}

TEST(PublishedJobs, AreKnownAsTheyWereSeenLast) {
  PublishedJobs jobs;
  EXPECT_FALSE(jobs.Find("a"));
  jobs.Publish(PublishedJob("a", 0));
  v1::Job further = PublishedJob("a", 0);
  further.set_message("waits for room");
  jobs.Publish(further);
  ASSERT_TRUE(jobs.Find("a"));
  EXPECT_EQ(jobs.Find("a")->message(), "waits for room");
  jobs.Remove("a");
  EXPECT_FALSE(jobs.Find("a"));
}

TEST(PublishedJobs, ForgetTheOldestOfAThousandThatHaveEnded) {
  PublishedJobs jobs;
  jobs.Publish(PublishedJob("runs", 0));
  for (int i = 0; i < 1001; ++i) jobs.Publish(PublishedJob("ended " + std::to_string(i), 1));
  EXPECT_FALSE(jobs.Find("ended 0"));
  EXPECT_TRUE(jobs.Find("ended 1"));
  EXPECT_TRUE(jobs.Find("ended 1000"));
  EXPECT_TRUE(jobs.Find("runs"));
}

TEST(PublishedJobs, KeepOneThatWasRetriedWhateverEndsMeanwhile) {
  PublishedJobs jobs;
  jobs.Publish(PublishedJob("a", 1));
  jobs.Publish(PublishedJob("a", 0));
  for (int i = 0; i < 1500; ++i) jobs.Publish(PublishedJob("ended " + std::to_string(i), 1));
  EXPECT_TRUE(jobs.Find("a"));
}

}  // namespace
}  // namespace weft
