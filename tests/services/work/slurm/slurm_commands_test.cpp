#include "services/work/slurm/slurm_commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace weft
