// The trainer is a program beside this one: these tests run in a copy of their program, which has one that
// acts.
#include "services/tools/cli/net_trainer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>

#include "services/work/executor/run_program.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string OwnFolder() { return fs::read_symlink("/proc/self/exe").parent_path().string(); }

// Acts as the file of samples is called.
constexpr char kActing[] = R"(#!/bin/sh
echo "$@" > "$4/asked"
case "$2" in
  good) echo '{"step": 3, "loss": 0.5}'; echo 'no JSON'; echo '{"step": 4}' ;;
  bad) head -c 600 /dev/zero | tr '\0' x >&2; echo 'no samples' >&2; exit 3 ;;
  slow) trap 'echo ended > "$4/told"; exit 1' TERM; echo '{"step": 1}'; while :; do sleep 0.01; done ;;
esac
)";

class NetTrainer : public ::testing::Test {
 protected:
  // Runs the test in a copy where this is none.
  static bool IsCopy() {
    constexpr char kInCopy[] = "WEFT_TEST_OF_COPY";
    if (getenv(kInCopy) != nullptr) return true;
    const TempFolder folder;
    fs::copy_file("/proc/self/exe", folder / "copy");
    WriteBytes(folder / "weft-train", kActing);
    chmod((folder / "weft-train").c_str(), 0755);
    setenv(kInCopy, "1", 1);
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    const auto told = RunProgram(folder / "copy", {.arguments = {"--gtest_filter=NetTrainer." + name}});
    unsetenv(kInCopy);
    EXPECT_TRUE(told.ok()) << told.status();
    EXPECT_THAT(told.value_or(""), HasSubstr("PASSED  ] 1 test"));
    return false;
  }
  absl::Status Train(const std::string& samples, NetKind kind = NetKind::kCorrection, double hours = 0) {
    NetTask task{kind, samples, folder_.path(), 500, hours, 7, 2};
    steps_.clear();
    return RunNetTrainer(
        task,
        [this](const v1::NetTrainingProgress& now) {
          steps_.push_back(now.step());
          if (samples_stop_) stop_.request_stop();
        },
        stop_.get_token());
  }
  std::string Asked() const { return ReadBytes(folder_ / "asked"); }

  const TempFolder folder_;
  std::vector<int64_t> steps_;
  std::stop_source stop_;
  bool samples_stop_ = false;
};

TEST_F(NetTrainer, IsToldTheTaskAndTellsItsSteps) {
  if (!IsCopy()) return;
  ASSERT_TRUE(CheckNetTrainer().ok());
  const std::string rest = " --out " + folder_.path() + " --steps 500 --seed 7 --threads 2";
  EXPECT_TRUE(Train("good").ok());
  EXPECT_EQ(Asked(), "net good" + rest + "\n");
  EXPECT_THAT(steps_, ElementsAre(3, 4));
  EXPECT_TRUE(Train("good", NetKind::kPixels, 0.5).ok());
  EXPECT_EQ(Asked(), "pixels good" + rest + " --minutes 30\n");
  EXPECT_TRUE(Train("good", NetKind::kPrior).ok());
  EXPECT_EQ(Asked(), "prior good" + rest + "\n");
}

TEST_F(NetTrainer, AFailureHasTheEndOfWhatItPrinted) {
  if (!IsCopy()) return;
  const absl::Status failed = Train("bad");
  EXPECT_TRUE(absl::IsInternal(failed)) << failed;
  EXPECT_EQ(failed.message(),
            "weft-train: exit status 3; it printed: " + std::string(489, 'x') + "no samples");
}

TEST_F(NetTrainer, IsToldToEnd) {
  if (!IsCopy()) return;
  samples_stop_ = true;
  EXPECT_EQ(Train("slow"),
            absl::CancelledError("the training of the net was stopped; the same command goes on with it"));
  EXPECT_EQ(ReadBytes(folder_ / "told"), "ended\n");
  EXPECT_THAT(steps_, ElementsAre(1));
}

TEST_F(NetTrainer, IsMissingWhereItIsNotInstalled) {
  if (!IsCopy()) return;
  const std::string program = OwnFolder() + "/weft-train";
  fs::rename(program, program + ".away");
  const absl::Status missing = CheckNetTrainer();
  EXPECT_TRUE(absl::IsFailedPrecondition(missing));
  EXPECT_THAT(std::string(missing.message()),
              HasSubstr("--net needs weft-train, and " + program + " is missing"));
  EXPECT_FALSE(Train("good").ok());
  fs::rename(program + ".away", program);
}

}  // namespace
}  // namespace weft
