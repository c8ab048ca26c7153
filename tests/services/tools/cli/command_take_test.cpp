// weft take info, verify, recover, test-disk.
#include <filesystem>

#include "services/formats/verdict/verdict.h"
#include "tests/services/tools/cli/small_take.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

class CommandTake : public SmallTakeTest {};

TEST_F(CommandTake, InfoTellsWhatItHoldsWhateverTheVerdict) {
  const AloudRun run = Take({"info", take_});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(
      run.out,
      StartsWith("bad: 3 of 4 frame sets have all cameras; right: 1 frame missing: no image in the dump\n"));
  EXPECT_THAT(run.out, HasSubstr(take_ + ": take " + IdOf(take_) +
                                 ", closed; 3 of 4 sets have all cameras\n"
                                 "4 frame sets of 2 cameras, 0.1 s, 0.00 GB\n"
                                 "from images of images\n"
                                 "camera   frames  missing  interval ms   jitter ms  offset ms   worst ms\n"
                                 "left          4        0       33.333      0.0000     0.0000     0.0000\n"
                                 "right         3        1       33.333      0.0000     0.0000     0.0000\n"
                                 "right: 1 frame missing: no image in the dump\n"));
  const auto info = FromJson<v1::TakeInfo>(Take({"info", take_, "--json"}).out);
  EXPECT_EQ(info.path(), take_);
  EXPECT_EQ(info.sets_complete(), 3u);
  EXPECT_EQ(Take({"info", folder_ / "none"}).status.code(), absl::StatusCode::kNotFound);
}

TEST_F(CommandTake, VerifyTellsAWholeTakeFromADamagedOne) {
  const AloudRun whole = Take({"verify", take_});
  EXPECT_TRUE(whole.status.ok()) << whole.status;
  EXPECT_EQ(
      whole.out,
      "usable: whole, and 1 frames are missing, each with its reason\n"
      "  remedy: `weft take info " +
          take_ + "` shows the reasons\n" + take_ +
          ": whole; 4 frame sets, 3 of them with all cameras; 7 frames intact, 1 missing with a reason, 0 "
          "sets dropped with a cause, 0.00 GB read\n");
  EXPECT_TRUE(FromJson<v1::TakeCheckReport>(Take({"verify", take_, "--json"}).out).whole());
  std::filesystem::remove(take_ + "/ledger.csv");
  const AloudRun damaged = Take({"verify", take_});
  EXPECT_TRUE(IsVerdict(damaged.status)) << damaged.status;
  EXPECT_THAT(damaged.out, HasSubstr(": not whole; "));
  EXPECT_THAT(damaged.out, HasSubstr("\nproblem: "));
  EXPECT_TRUE(IsVerdict(Take({"verify", take_, "--json"}).status));
}

TEST_F(CommandTake, RecoverAsksForForceAndMayOnlySayWhatItWouldDo) {
  EXPECT_EQ(Take({"recover", take_}).status.code(), absl::StatusCode::kFailedPrecondition);
  std::filesystem::remove(take_ + "/ledger.csv");
  const std::string before = ReadBytes(take_ + "/take.json");
  const AloudRun dry = Take({"recover", "--force", "--dry-run", take_});
  EXPECT_THAT(dry.out, HasSubstr("\nwould do: "));
  EXPECT_FALSE(std::filesystem::exists(take_ + "/ledger.csv"));
  EXPECT_EQ(ReadBytes(take_ + "/take.json"), before);
  const AloudRun run = Take({"recover", "--force", take_, "--json"});
  const auto report = FromJson<v1::TakeRecoveryReport>(run.out);
  EXPECT_FALSE(report.dry_run());
  EXPECT_EQ(report.sets(), 4u);
  EXPECT_GE(report.changes_size(), 1);
  EXPECT_TRUE(std::filesystem::exists(take_ + "/ledger.csv"));
}

TEST_F(CommandTake, PurgeRemovesWhatEarlierRecoveriesKept) {
  WriteBytes(take_ + "/recovered/old", std::string(20'000'000, 'x'));
  const AloudRun run = Take({"recover", "--purge", take_});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, take_ + ": 0.02 GB of earlier recoveries removed\n");
  EXPECT_FALSE(std::filesystem::exists(take_ + "/recovered/old"));
}

TEST_F(CommandTake, TestDiskMeasuresAndLeavesNothing) {
  const AloudRun run = Take({"test-disk", folder_.path(), "--size-gib", "0.01"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(
      run.out.substr(folder_.path().size()),
      MatchesRegex(": [0-9.]+ GB/s( .through the page cache.)?, slowest write of 8 MiB [0-9]+ ms, [0-9]+ GB "
                   "free: [0-9.]+ (s|min|h) at the disk's full speed\n"));
  EXPECT_THAT(run.out, testing::Not(HasSubstr(" 0.00 GB/s")));
  std::vector<std::string> left;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    left.push_back(entry.path().filename());
  EXPECT_THAT(left, testing::UnorderedElementsAre("images", "take"));
  EXPECT_EQ(Take({"test-disk", folder_ / "none"}).status.code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
