#include "services/work/executor/process_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class ProcessRecordTest : public ::testing::Test {
 protected:
  ProcessRecordTest() {
    child_ = fork();
    if (child_ == 0) {
      pause();
      _exit(0);
    }
  }
  ~ProcessRecordTest() override {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  std::string PathOf(pid_t pid) { return folder_ / "processes/" + std::to_string(pid); }

  TempFolder folder_;
  pid_t child_ = -1;
};

TEST_F(ProcessRecordTest, FindsAProcessUntilItHasEnded) {
  ASSERT_TRUE(ProcessRecord::Make(folder_ / "processes", child_).ok());
  EXPECT_FALSE(fs::exists(PathOf(child_)));  // its record did not live
  absl::StatusOr<ProcessRecord> record = ProcessRecord::Make(folder_ / "processes", child_);
  ASSERT_TRUE(record.ok()) << record.status();
  EXPECT_THAT(FindRecorded(folder_ / "processes"), ElementsAre(child_));
  kill(child_, SIGKILL);
  siginfo_t info;
  waitid(P_PID, static_cast<id_t>(child_), &info, WEXITED | WNOWAIT);  // nobody has reaped it
  EXPECT_THAT(FindRecorded(folder_ / "processes"), IsEmpty());
  EXPECT_FALSE(fs::exists(PathOf(child_)));
}

TEST_F(ProcessRecordTest, OthersOfTheSameNumberAreNotMeant) {
  absl::StatusOr<ProcessRecord> record = ProcessRecord::Make(folder_ / "processes", child_);
  ASSERT_TRUE(record.ok());
  const std::string mine = ReadBytes(PathOf(child_));
  for (const std::string& other : {mine + "1", "0" + mine, std::string()}) {
    WriteBytes(PathOf(child_), other);
    EXPECT_THAT(FindRecorded(folder_ / "processes"), IsEmpty()) << other;
  }
  WriteBytes(PathOf(child_), mine);
  WriteBytes(folder_ / "processes/notes", "x");
  EXPECT_THAT(FindRecorded(folder_ / "processes"), ElementsAre(child_));
}

TEST_F(ProcessRecordTest, ARecordThatMovesStandsOnce) {
  absl::StatusOr<ProcessRecord> record = ProcessRecord::Make(folder_ / "processes", child_);
  ASSERT_TRUE(record.ok());
  ProcessRecord moved = *std::move(record);
  EXPECT_TRUE(fs::exists(PathOf(child_)));
  moved = ProcessRecord();
  EXPECT_FALSE(fs::exists(PathOf(child_)));
}

TEST_F(ProcessRecordTest, NoFolderNoRecords) { EXPECT_THAT(FindRecorded(folder_ / "none"), IsEmpty()); }

}  // namespace
}  // namespace weft
