// Which ended jobs a daemon forgets, and what stays of them.
#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

namespace fs = std::filesystem;

constexpr double kMoment_days = 1e-7;  // 9 ms

class JobRetentionTest : public DaemonTest {
 protected:
  std::vector<std::string> JobIds() {
    const auto jobs = client_->List(100);
    EXPECT_TRUE(jobs.ok()) << jobs.status();
    std::vector<std::string> ids;
    for (const v1::Job& job : *jobs) ids.push_back(job.id());
    return ids;
  }
  bool WaitForJobs(size_t count) {
    for (int i = 0; i < 500 && JobIds().size() != count; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return JobIds().size() == count;
  }
  void Forget(double days) {
    v1::RetentionRules rules;
    rules.set_keep_jobs_days(days);
    daemon_->SetRetention(rules);
  }
  std::string ResultsOf(const std::string& id) { return folder_ / absl::StrCat("state/results/", id); }
};

TEST_F(JobRetentionTest, ForgetsEndedJobsAndTheirResultsInTheStateFolder) {
  StartDaemon();
  const std::string elsewhere = Submit({"a"});
  v1::SubmitJobRequest request = MakeRequest({"a"}, "own");
  request.mutable_spec()->clear_out();
  const auto own = client_->Submit(request);
  ASSERT_TRUE(own.ok()) << own.status();
  WaitForEnd(elsewhere);
  WaitForEnd(own->id());
  ASSERT_TRUE(fs::exists(ResultsOf(own->id())));
  EXPECT_EQ(JobIds().size(), 2u);

  Forget(kMoment_days);
  ASSERT_TRUE(WaitForJobs(0));
  EXPECT_EQ(client_->Get(own->id()).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(fs::exists(ResultsOf(own->id())));
  EXPECT_TRUE(fs::exists(folder_ / "out/job.json"));

  daemon_.reset();
  StartDaemon();
  EXPECT_THAT(JobIds(), IsEmpty());
}

TEST_F(JobRetentionTest, KeepsYoungAndUnfinishedJobs) {
  StartDaemon();
  WaitForEnd(Submit({"a"}, "young"));
  Forget(1);
  const std::string running = Submit({"hang"}, "running");
  WatchUntilRunning(running);
  EXPECT_EQ(JobIds().size(), 2u);
  Forget(kMoment_days);
  ASSERT_TRUE(WaitForJobs(1));
  EXPECT_THAT(JobIds(), ElementsAre(running));
}

TEST_F(JobRetentionTest, KeepsResultsThatAJobStartsFrom) {
  options_.workers = 2;
  StartDaemon();
  const std::string first = Submit({"a"}, "first");
  WaitForEnd(first);
  v1::SubmitJobRequest request = MakeRequest({"hang"}, "second");
  request.mutable_spec()->mutable_options()->set_starts(folder_ / "first");
  const auto second = client_->Submit(request);
  ASSERT_TRUE(second.ok()) << second.status();
  WatchUntilRunning(second->id());
  WaitForEnd(Submit({"a"}, "third"));
  Forget(kMoment_days);
  ASSERT_TRUE(WaitForJobs(2));
  EXPECT_THAT(JobIds(), ElementsAre(second->id(), first));
}

TEST_F(JobRetentionTest, FinishesWhatAKilledDaemonWasAt) {
  WriteBytes(ResultsOf(".forgotten-old") + "/0000/mesh.ply", "half removed");
  options_.retention.set_keep_jobs_days(1);
  StartDaemon();
  for (int i = 0; i < 500 && fs::exists(ResultsOf(".forgotten-old")); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_FALSE(fs::exists(ResultsOf(".forgotten-old")));
  EXPECT_THAT(client_->info().warnings(), IsEmpty());
}

}  // namespace
}  // namespace weft
