// Limits of the cluster, and jobs of others on it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "tests/services/work/slurm/played_slurm.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using SlurmLimitsTest = SlurmExecutorTest;

TEST_F(SlurmLimitsTest, ArraysAreAsLargeAsTheClusterPermits) {
  Write("config", "MaxArraySize            = 4\nMaxJobCount             = 10000\n");
  Write("limit", "4\n");
  Write("limit.words", "sbatch: error: Batch job submission failed: Invalid job array specification\n");
  Begin();
  for (int i = 1; i <= 10; ++i) Start(absl::StrCat("a.", i), {absl::StrCat("f", i)});
  for (int i = 1; i <= 10; ++i) EXPECT_TRUE(WaitForEnd(absl::StrCat("a.", i)).end->clean) << i;
  EXPECT_EQ(Lines("sbatch.log").size(), 3u) << Read("sbatch.log");
}

TEST_F(SlurmLimitsTest, ArraysThatAreTooManyAreSplit) {
  for (const char* words : {"sbatch: error: Batch job submission failed: Invalid job array specification\n",
                            "sbatch: error: Slurm temporarily unable to accept job, sleeping and retrying\n",
                            "sbatch: error: QOSMaxSubmitJobPerUserLimit\nsbatch: error: Batch job submission "
                            "failed: Job violates "
                            "accounting/QOS policy (job submit limit, user's size and/or time limits)\n"}) {
    Write("limit", "3\n");
    Write("limit.words", words);
    Begin();
    for (int i = 1; i <= 12; ++i) Start(absl::StrCat("a.", i), {absl::StrCat("f", i)});
    for (int i = 1; i <= 12; ++i) EXPECT_TRUE(WaitForEnd(absl::StrCat("a.", i)).end->clean) << i << words;
    executor_.reset();
    told_.clear();
  }
}

TEST_F(SlurmLimitsTest, JobsOfOthersThatCannotBeReadAreTheirs) {
  Write("hold", "x");
  Write("squeue.json", R"({"jobs": [{"job_id": 55, "array_job_id": 55, "array_task_string": "5-,...",
    "job_state": "PENDING"}, {"job_id": 56}, {"job_id": 101, "array_job_id": 101, "array_task_id": 0,
    "job_state": "PENDING", "state_reason": "PartitionDown"}], "errors": []})");
  Begin();
  Start("a.1", {"f1"});
  const Told told = WaitUntil("a.1", [](const Told& one) { return !one.waits.empty(); });
  EXPECT_THAT(told.waits.front(), HasSubstr("the default partition is down"));
  Write("squeue.json", kNoJobs);
}

TEST_F(SlurmLimitsTest, ATaskWhoseRecordCannotBeReadIsNotLost) {
  Write("hold", "x");
  Write("squeue.json", R"({"jobs": [{"job_id": 101, "array_job_id": 101, "array_task_id": 0,
    "job_state": 7}], "errors": []})");
  Begin([](SlurmOptions& options) { options.lag_s = 0.3; });
  Start("a.1", {"f1"});
  const Told told = WaitUntil("a.1", [](const Told& one) { return one.waits.size() > 5; });
  EXPECT_FALSE(told.end);
  EXPECT_THAT(told.waits.front(), HasSubstr("job_state has a value of an unknown kind"));
  Write("squeue.json", kNoJobs);
}

}  // namespace
}  // namespace weft
