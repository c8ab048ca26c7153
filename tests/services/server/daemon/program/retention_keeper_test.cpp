#include "services/server/daemon/program/retention_keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <atomic>
#include <mutex>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "services/formats/files/json_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/captured_log.h"
#include "tests/services/server/daemon/wait_until.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kInstant_days = 1e-7;  // 9 ms

// Sources are lists of this test; what the keeper carries away is gone from them.
class RetentionKeeperTest : public ::testing::Test {
 protected:
  RetentionKeeperTest() {
    std::filesystem::create_directories(options_.takes_folder);
    audit_ = *AuditLog::Open(AuditLogFile(folder_.path()), [](const std::string&) {});
  }

  Holding Held(v1::HoldingKind kind, const std::string& id, uint64_t bytes = 0, bool kept = false) const {
    return {kind, id, since_unix_ns_, bytes, kept};
  }

  // A source of these kinds with what `held_` has of them.
  void AddSource(const std::set<v1::HoldingKind>& kinds, std::chrono::seconds longest_pause) {
    RetentionSource source;
    source.kinds = kinds;
    source.longest_pause = longest_pause;
    source.list = [this, kinds] {
      ++looks_;
      const std::lock_guard lock(mutex_);
      std::vector<Holding> held = held_;
      std::erase_if(held, [&](const Holding& one) { return !kinds.contains(one.kind); });
      return held;
    };
    source.is_in_use = [](const RetentionStep& step) { return step.id == "used"; };
    source.carry = [this](const RetentionStep& step) -> absl::Status {
      if (step.id == "stuck") return absl::FailedPreconditionError("its disk\nis away");
      const std::lock_guard lock(mutex_);
      audited_before_.push_back(!Audited(step.id).empty());
      carried_.push_back(step.id);
      std::erase_if(held_, [&](const Holding& one) { return one.id == step.id; });
      return absl::OkStatus();
    };
    options_.sources.push_back(std::move(source));
  }

  void Start() { keeper_ = std::make_unique<RetentionKeeper>(options_, *audit_); }

  std::vector<std::string> Carried() {
    const std::lock_guard lock(mutex_);
    return carried_;
  }

  // "CALLER METHOD ABOUT OUTCOME MESSAGE" of the entries about this id.
  std::vector<std::string> Audited(const std::string& id) const {
    std::vector<std::string> lines;
    const std::vector<v1::AuditEntry> log = *ReadAuditLog(AuditLogFile(folder_.path()), 1000);
    for (const v1::AuditEntry& entry : log) {
      std::map<std::string, std::string> about(entry.about().begin(), entry.about().end());
      std::string text;
      bool is_about = false;
      for (const auto& [name, value] : about) {
        absl::StrAppend(&text, name, "=", value, ", ");
        is_about = is_about || value == id;
      }
      if (is_about)
        lines.push_back(absl::StrCat(entry.caller(), " ", entry.method(), " ", text, entry.outcome(), " ",
                                     entry.message()));
    }
    return lines;
  }

  const TempFolder folder_;
  const CapturedLog log_;
  const int64_t since_unix_ns_ = HostTime_ns() - 3600 * int64_t{1'000'000'000};
  RetentionKeeperOptions options_{folder_ / "retention.json", folder_ / "takes", DefaultRules(), {}};
  std::unique_ptr<AuditLog> audit_;
  std::atomic<int> looks_ = 0;
  std::mutex mutex_;
  std::vector<Holding> held_;
  std::vector<std::string> carried_;
  std::vector<bool> audited_before_;
  std::unique_ptr<RetentionKeeper> keeper_;
};

TEST_F(RetentionKeeperTest, WritesDownWhatItDoesBeforeItDoesIt) {
  options_.rules.set_keep_jobs_days(kInstant_days);
  for (const char* id : {"old", "used", "stuck"}) held_.push_back(Held(v1::HOLDING_KIND_JOB, id, 7));
  held_.push_back(Held(v1::HOLDING_KIND_JOB, "kept", 7, true));
  held_.push_back(Held(v1::HOLDING_KIND_JOB, "empty", 0));
  AddSource({v1::HOLDING_KIND_JOB}, std::chrono::seconds(60));
  Start();
  ASSERT_TRUE(WaitUntil([this] { return Carried().size() == 2 && Audited("stuck").size() >= 2; }));
  const v1::RetentionRehearsal rehearsal = keeper_->Rehearse({}, 0);
  keeper_.reset();
  EXPECT_THAT(Carried(), ElementsAre("old", "empty"));
  EXPECT_THAT(audited_before_, ElementsAre(true, true));
  const std::string why = "OK it ended more than 1e-07 days ago";
  EXPECT_THAT(Audited("old"),
              ElementsAre("weftd Retention bytes=7, job=old, to=nothing, it is removed, " + why));
  EXPECT_THAT(Audited("empty"), ElementsAre("weftd Retention job=empty, to=nothing, it is removed, " + why));
  EXPECT_EQ(Audited("stuck")[0], "weftd Retention bytes=7, job=stuck, to=nothing, it is removed, " + why);
  EXPECT_THAT(Audited("stuck")[1],
              AllOf(HasSubstr("job=stuck"), HasSubstr("FAILED_PRECONDITION its disk"), HasSubstr("is away")));
  EXPECT_THAT(Audited("used"), IsEmpty());
  EXPECT_THAT(log_.Lines(), Contains("info job old is removed: it ended more than 1e-07 days ago"));
  EXPECT_GE(log_.Count("warning job stuck stays: its disk"), 1);
  // The newest first.
  ASSERT_THAT(rehearsal.done(), SizeIs(2));
  EXPECT_EQ(rehearsal.done(0).id(), "empty");
  EXPECT_EQ(rehearsal.done(1).ShortDebugString(),
            "kind: HOLDING_KIND_JOB id: \"old\" because: \"it ended more than 1e-07 days ago\" bytes: 7");
}

TEST_F(RetentionKeeperTest, MovesTakesToTheTrashAndSaysOnceWhatItCannotDo) {
  options_.rules.set_keep_takes_days(kInstant_days);
  options_.rules.set_takes_quota_gib(1e-9);
  held_ = {Held(v1::HOLDING_KIND_TAKE, "old", 5), Held(v1::HOLDING_KIND_TAKE, "pinned", 100, true)};
  AddSource({v1::HOLDING_KIND_TAKE, v1::HOLDING_KIND_TRASH}, std::chrono::seconds(60));
  Start();
  ASSERT_TRUE(WaitUntil([this] { return !Carried().empty() && looks_ >= 4; }));
  keeper_.reset();
  EXPECT_THAT(Audited("old"), ElementsAre(HasSubstr("bytes=5, take=old, to=the trash, OK ")));
  EXPECT_THAT(log_.Lines(), Contains("info take old goes to the trash: it ended more than 1e-07 days ago"));
  EXPECT_EQ(log_.Count("warning retention: takes and trash have more than 1e-09 GiB, but nothing goes"), 1);
}

TEST_F(RetentionKeeperTest, DoesNothingThatItCannotWriteDown) {
  signal(SIGXFSZ, SIG_IGN);
  options_.rules.set_keep_jobs_days(kInstant_days);
  held_ = {Held(v1::HOLDING_KIND_JOB, "old")};
  AddSource({v1::HOLDING_KIND_JOB}, std::chrono::seconds(60));
  rlimit before = {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full = {0, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  Start();
  const bool has_looked = WaitUntil([this] { return looks_ >= 4; });
  const std::vector<std::string> carried = Carried();
  setrlimit(RLIMIT_FSIZE, &before);
  ASSERT_TRUE(has_looked);
  EXPECT_THAT(carried, IsEmpty());
  EXPECT_TRUE(WaitUntil([this] { return Carried().size() == 1; }));
  keeper_.reset();
  EXPECT_EQ(log_.Count("retention.json"), 1) << "its state could not be written either";
}

TEST_F(RetentionKeeperTest, LooksAtOnceWhenTheRulesChange) {
  held_ = {Held(v1::HOLDING_KIND_JOB, "old")};
  AddSource({v1::HOLDING_KIND_JOB}, std::chrono::seconds(3600));
  Start();
  ASSERT_TRUE(WaitUntil([this] { return looks_ == 1; }));
  keeper_->SetRules(DefaultRules());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(looks_, 1) << "the rules are the same";
  v1::RetentionRules rules = DefaultRules();
  rules.set_keep_jobs_days(kInstant_days);
  keeper_->SetRules(rules);
  EXPECT_TRUE(WaitUntil([this] { return Carried().size() == 1; }));
  EXPECT_GE(looks_, 3) << "twice, before it does anything";
}

TEST_F(RetentionKeeperTest, KeepsInMindAHundredStepsAtTheMost) {
  options_.rules.set_keep_jobs_days(kInstant_days);
  for (int i = 0; i < 101; ++i) held_.push_back(Held(v1::HOLDING_KIND_JOB, absl::StrFormat("j%03d", i)));
  AddSource({v1::HOLDING_KIND_JOB}, std::chrono::seconds(60));
  Start();
  ASSERT_TRUE(WaitUntil([this] { return Carried().size() == 101; }));
  ASSERT_TRUE(WaitUntil([this] { return keeper_->Rehearse({}, 0).done(0).id() == "j100"; }));
  const v1::RetentionRehearsal rehearsal = keeper_->Rehearse({}, 0);
  EXPECT_THAT(rehearsal.done(), SizeIs(100));
  EXPECT_EQ(rehearsal.done(99).id(), "j001");
}

TEST_F(RetentionKeeperTest, RehearsesOtherRulesWithoutDoingAnything) {
  held_ = {Held(v1::HOLDING_KIND_JOB, "old", 3), Held(v1::HOLDING_KIND_JOB, "used"),
           Held(v1::HOLDING_KIND_JOB, "kept", 0, true), Held(v1::HOLDING_KIND_TAKE, "take", 1 << 20)};
  AddSource({v1::HOLDING_KIND_JOB}, std::chrono::seconds(3600));
  AddSource({v1::HOLDING_KIND_TAKE, v1::HOLDING_KIND_TRASH}, std::chrono::seconds(3600));
  Start();
  v1::RetentionRules asked;
  asked.set_keep_jobs_days(2);
  EXPECT_THAT(keeper_->Rehearse(asked, 1).steps(), IsEmpty());
  const v1::RetentionRehearsal rehearsal = keeper_->Rehearse(asked, 3);
  ASSERT_THAT(rehearsal.steps(), SizeIs(1));
  EXPECT_EQ(rehearsal.steps(0).id(), "old");
  EXPECT_EQ(rehearsal.steps(0).bytes(), 3);
  EXPECT_FALSE(rehearsal.steps(0).to_trash());
  EXPECT_NEAR(rehearsal.steps(0).due_in_s(), 2 * 86400, 60) << "seen from when the keeper began";
  EXPECT_EQ(rehearsal.rules().keep_jobs_days(), 2);
  EXPECT_EQ(rehearsal.rules().keep_trash_days(), 7);
  EXPECT_THAT(rehearsal.notes(), IsEmpty());
  asked.clear_keep_jobs_days();
  asked.set_least_free_gib(1e6);
  EXPECT_THAT(keeper_->Rehearse(asked, 0).notes(),
              ElementsAre(HasSubstr("less than 1e+06, and takes did not take the last ")));
  // Where nobody can tell how much is free, nothing goes for want of it.
  std::filesystem::remove_all(options_.takes_folder);
  EXPECT_THAT(keeper_->Rehearse(asked, 0).notes(), IsEmpty());
  EXPECT_THAT(Carried(), IsEmpty());
}

TEST_F(RetentionKeeperTest, GoesOnWithTheTimeThatTheOneBeforeSaw) {
  const auto read = [this] {
    v1::RetentionState state;
    EXPECT_TRUE(ReadJsonFile(options_.state_file, state).ok());
    return state;
  };
  Start();
  ASSERT_TRUE(WaitUntil([this] { return std::filesystem::exists(options_.state_file); })) << "at the begin";
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  keeper_.reset();
  ASSERT_THAT(read().periods(), SizeIs(1));
  const int64_t seen_ns = read().periods(0).end_unix_ns() - read().periods(0).begin_unix_ns();
  EXPECT_GE(seen_ns, 60'000'000) << "up to the end";
  Start();
  EXPECT_GE(keeper_->Rehearse({}, 0).seen_days(), static_cast<double>(seen_ns) / 86400e9);
  keeper_.reset();
  EXPECT_THAT(read().periods(), SizeIs(2));
  EXPECT_EQ(log_.Count("ages count"), 0);
  WriteBytes(options_.state_file, "{\"periods\": [");
  Start();
  EXPECT_LT(keeper_->Rehearse({}, 0).seen_days(), static_cast<double>(seen_ns) / 86400e9);
  EXPECT_EQ(log_.Count("; ages count from now on"), 1);
}

}  // namespace
}  // namespace weft
