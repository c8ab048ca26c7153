#include "services/work/slurm/slurm_commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

// As Slurm 22.05 prints them.
TEST(SlurmCommands, RefusalsForGoodAreToldFromThoseThatPass) {
  for (const char* printed :
       {"sbatch: error: invalid partition specified: gpu",
        "sbatch: error: Batch job submission failed: Invalid account or account/partition combination "
        "specified",
        "sbatch: unrecognized option '--frobnicate'",
        "sbatch: error: Batch job submission failed: Requested node configuration is not available"})
    EXPECT_TRUE(IsRefusedForGood(printed)) << printed;
  for (const char* printed :
       {"",
        "sbatch: error: Batch job submission failed: Unable to contact slurm controller (connect failure)",
        "sbatch: error: Batch job submission failed: Socket timed out on send/recv operation"})
    EXPECT_FALSE(IsRefusedForGood(printed)) << printed;
}

TEST(SlurmCommands, TooManyElementsMayBeFewerLater) {
  EXPECT_TRUE(IsTooMany("sbatch: error: Batch job submission failed: Invalid job array specification"));
  EXPECT_TRUE(IsTooMany("sbatch: error: Slurm temporarily unable to accept job, sleeping and retrying"));
  EXPECT_FALSE(IsTooMany("sbatch: error: invalid partition specified: gpu"));
}

TEST(SlurmCommands, TheCommandThatIsMissingIsNamed) {
  const TempFolder folder;
  const absl::Status status = SlurmCommands::Find(folder.path()).status();
  EXPECT_TRUE(absl::IsNotFound(status));
  EXPECT_THAT(std::string(status.message()),
              ::testing::StartsWith("sbatch: no such program in " + folder.path()));
}

// Programs in the place of Slurm's; each notes its arguments in <name>.log.
class PlayedCommands : public ::testing::Test {
 protected:
  PlayedCommands() {
    for (const char* name : {"sbatch", "squeue", "scancel", "scontrol"}) Play(name, "");
  }
  void Play(const std::string& name, const std::string& script) {
    WriteBytes(folder_ / name,
               absl::StrCat("#!/bin/sh\necho \"$SLURM_BITSTR_LEN\" \"$@\" >> \"$0.log\"\n", script));
    std::filesystem::permissions(folder_ / name, std::filesystem::perms::owner_all);
  }
  SlurmCommands Commands() { return SlurmCommands::Find(folder_.path()).value(); }
  std::string Log(const std::string& name) { return ReadBytes(folder_ / (name + ".log")); }

  const TempFolder folder_;
};

TEST_F(PlayedCommands, SubmitReadsTheIdOfTheJob) {
  for (const auto& [printed, id] : {std::pair("12\\n", 12), {"13;cluster\\n", 13}, {"1", 1}}) {
    Play("sbatch", absl::StrCat("printf '", printed, "'\n"));
    EXPECT_EQ(Commands().Submit({"--array=0-1", "run.sh"}).value_or(-1), id);
  }
  EXPECT_THAT(Log("sbatch"), ::testing::StartsWith(" --array=0-1 run.sh\n"));
  for (const char* printed : {"0", "-3", "Submitted batch job 12", ""}) {
    Play("sbatch", absl::StrCat("printf %s '", printed, "'\n"));
    const absl::Status status = Commands().Submit({}).status();
    EXPECT_TRUE(absl::IsUnavailable(status));
    EXPECT_EQ(status.message(),
              absl::StrCat("sbatch printed \"", printed, "\" where the id of a job was expected"));
  }
}

TEST_F(PlayedCommands, SubmitTellsTheErrorLineAndWhatItMeans) {
  const auto refused = [this](const std::string& words) {
    Play("sbatch", absl::StrCat("echo 'sbatch: warning: first' >&2; echo '", words, "' >&2; exit 1\n"));
    return Commands().Submit({}).status();
  };
  EXPECT_EQ(refused("sbatch: error: invalid partition specified: fast"),
            absl::FailedPreconditionError("sbatch: error: invalid partition specified: fast"));
  EXPECT_EQ(refused("sbatch: error: Slurm temporarily unable to accept job").code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused("sbatch: error: Socket timed out").code(), absl::StatusCode::kUnavailable);
}

TEST_F(PlayedCommands, MostElementsAreFewerThanBothLimits) {
  const auto most = [this](const std::string& config) {
    Play("scontrol", absl::StrCat("printf '", config, "'\n"));
    return Commands().MostElements().value_or(-1);
  };
  EXPECT_EQ(most("MaxArraySize = 1001\\nMaxJobCount = 10000\\n"), 1001);
  EXPECT_EQ(most("MaxArraySize = 1001\\nMaxJobCount = 500\\nMaxStepCount = 4\\n"), 499);
  EXPECT_EQ(most("MaxJobCount = 1\\n"), 1);
  EXPECT_EQ(most("MaxJobCount = many\\n"), std::numeric_limits<int>::max());
  EXPECT_THAT(Log("scontrol"), ::testing::StartsWith(" show config\n"));
  Play("scontrol", "exit 1\n");
  EXPECT_TRUE(absl::IsUnavailable(Commands().MostElements().status()));
}

TEST_F(PlayedCommands, QueryAsksSqueueForAllJobsAndWholeLists) {
  Play("squeue", R"(echo '{"jobs": [{"job_id": 3, "job_state": "RUNNING"}], "errors": []}')");
  const auto records = Commands().Query();
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(records->size(), 1u);
  EXPECT_EQ(Log("squeue"), "0 --json --states=all --me\n");
  EXPECT_EQ(Log("scontrol"), "");
  Play("squeue", R"(echo '{"jobs": [], "errors": [{"description": "away"}]}')");
  EXPECT_EQ(Commands().Query().status(), absl::UnavailableError("squeue: away"));
  EXPECT_EQ(Log("scontrol"), "") << "it answered";
}

TEST_F(PlayedCommands, QueryAsksScontrolWhereSqueueHasNoJson) {
  Play("squeue", "echo 'squeue: error: unrecognized option --json' >&2; exit 1\n");
  Play("scontrol", "echo 'JobId=8 JobState=RUNNING'\n");
  const auto records = Commands().Query();
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(records->front().job_id, 8);
  EXPECT_EQ(Log("scontrol"), "0 show job\n");
  Play("scontrol", "echo nonsense\n");
  EXPECT_TRUE(absl::IsUnavailable(Commands().Query().status()));
  Play("scontrol", "echo 'scontrol: error: away' >&2; exit 1\n");
  EXPECT_THAT(std::string(Commands().Query().status().message()), ::testing::HasSubstr("unrecognized option"))
      << "the first answer says more";
  Play("squeue", "echo no JSON\n");
  EXPECT_THAT(std::string(Commands().Query().status().message()),
              ::testing::HasSubstr("scontrol: error: away"));
}

TEST_F(PlayedCommands, CancelNamesFiveHundredJobsAtOnceAtMost) {
  std::vector<std::string> jobs;
  for (int k = 0; k < 501; ++k) jobs.push_back(absl::StrCat(1000 + k));
  EXPECT_TRUE(Commands().Cancel(jobs).ok());
  const std::string log = Log("scancel");
  EXPECT_EQ(std::ranges::count(log, '\n'), 2);
  EXPECT_THAT(log, ::testing::StartsWith(" --quiet 1000 1001 "));
  EXPECT_THAT(log, ::testing::EndsWith(" 1499\n --quiet 1500\n"));
  EXPECT_TRUE(Commands().Cancel({}).ok());
  Play("scancel",
       "echo 'scancel: error: Kill job error on job id 7: Invalid job id specified' >&2; exit 1\n");
  EXPECT_TRUE(Commands().Cancel({"7"}).ok()) << "it has ended";
  Play("scancel", "echo 'scancel: error: Unable to contact slurm controller' >&2; exit 1\n");
  const absl::Status away = Commands().Cancel({"7"});
  EXPECT_TRUE(absl::IsUnavailable(away));
  EXPECT_THAT(std::string(away.message()),
              ::testing::EndsWith("scancel: error: Unable to contact slurm controller"));
}

TEST_F(PlayedCommands, SetThrottleNamesArrayAndNumber) {
  EXPECT_TRUE(Commands().SetThrottle(101, 3).ok());
  EXPECT_EQ(Log("scontrol"), " update JobId=101 ArrayTaskThrottle=3\n");
  Play("scontrol", "exit 1\n");
  EXPECT_TRUE(absl::IsUnavailable(Commands().SetThrottle(101, 3)));
}

}  // namespace
}  // namespace weft
