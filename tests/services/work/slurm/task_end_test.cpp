#include "services/work/slurm/task_end.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

TaskFacts Ended(const std::string& state, int64_t wait_status = 0) {
  TaskFacts facts;
  facts.record.emplace();
  facts.record->state = state;
  facts.record->node = "w2";
  facts.record->wait_status = wait_status;
  facts.lag_s = 30;
  return facts;
}

TaskFacts EndedByItself(int exit_status, const std::string& error_code = "") {
  TaskFacts facts;
  facts.host = "w1";
  facts.ended.emplace();
  facts.ended->set_exit_status(exit_status);
  if (!error_code.empty()) facts.error.emplace().set_code(error_code);
  return facts;
}

TEST(JudgeTask, BelievesWorkersThatEndByThemselves) {
  EXPECT_TRUE(JudgeTask(EndedByItself(0)).end.clean);
  const TaskVerdict bad_input = JudgeTask(EndedByItself(2, "NOT_FOUND"));
  EXPECT_FALSE(bad_input.end.clean);
  EXPECT_FALSE(bad_input.end.lost);
  EXPECT_THAT(bad_input.end.reason, HasSubstr("exit status 2 on node w1"));
}

TEST(JudgeTask, TellsLostNodesAndPreemptionFromBadInput) {
  for (const auto& [state, words] : {std::pair<const char*, const char*>{"NODE_FAIL", "node w2 failed"},
                                     {"BOOT_FAIL", "node w2 failed"},
                                     {"PREEMPTED", "a job of higher priority took node w2"},
                                     {"CANCELLED", "cancelled in Slurm, not by Weft"}}) {
    const TaskVerdict verdict = JudgeTask(Ended(state));
    EXPECT_TRUE(verdict.end.lost) << state;
    EXPECT_FALSE(verdict.error) << state;
    EXPECT_THAT(verdict.end.reason, HasSubstr(words));
  }
}

TEST(JudgeTask, AsksSlurmWhoStoppedAWorker) {
  TaskFacts facts = Ended("PREEMPTED");
  facts.ended.emplace().set_exit_status(1);
  facts.error.emplace().set_code("CANCELLED");
  EXPECT_FALSE(EndedByItself(facts));
  EXPECT_TRUE(JudgeTask(facts).end.lost);
  facts.was_stopped = true;
  EXPECT_TRUE(EndedByItself(facts));
  EXPECT_EQ(JudgeTask(facts).end.reason, "stopped");
}

TEST(JudgeTask, NamesSignalLogAndLastWordsOfAKilledWorker) {
  TaskFacts facts = Ended("FAILED", 9);
  facts.last_words = "cannot go on";
  facts.log_file = "/shared/log-3";
  const TaskVerdict verdict = JudgeTask(facts);
  EXPECT_FALSE(verdict.end.lost);
  EXPECT_EQ(verdict.end.reason,
            "killed by signal 9 (Killed) on node w2; its last output: cannot go on; log /shared/log-3");
}

TEST(JudgeTask, TimeLimitBeforeTheFirstFrameEndsTheJob) {
  TaskFacts facts = Ended("TIMEOUT");
  facts.time_limit_min = 1;
  const TaskVerdict too_short = JudgeTask(facts);
  ASSERT_TRUE(too_short.error);
  EXPECT_THAT(too_short.error->message(), HasSubstr("time limit of 1 min"));
  EXPECT_THAT(too_short.error->message(), HasSubstr("--slurm-time-limit-min"));
  facts.frames_finished = 3;
  EXPECT_TRUE(JudgeTask(facts).end.lost);
  EXPECT_FALSE(JudgeTask(facts).error);
}

TEST(JudgeTask, SaysWhichOptionMendsMemoryAndLag) {
  TaskFacts facts = Ended("OUT_OF_MEMORY");
  facts.memory_mib = 300;
  EXPECT_THAT(JudgeTask(facts).end.reason, HasSubstr("used more than its 300 MiB on node w2; raise "
                                                     "--slurm-memory-mib"));
  const TaskVerdict late = JudgeTask(Ended("COMPLETED"));
  EXPECT_TRUE(late.end.lost);
  EXPECT_THAT(late.end.reason, HasSubstr("raise --slurm-lag-s"));
}

TEST(JudgeTask, WaitsForRoomWhereTheFolderIsFull) {
  TaskFacts facts = Ended("FAILED", 1 << 8);
  facts.full_folder = "/shared/room: make room on the disk";
  const TaskVerdict verdict = JudgeTask(facts);
  EXPECT_TRUE(verdict.end.refused);
  EXPECT_THAT(verdict.end.reason, HasSubstr("make room"));
}

TEST(JudgeTask, LosesTasksThatSlurmForgot) {
  TaskFacts facts;
  facts.host = "w4";
  EXPECT_TRUE(JudgeTask(facts).end.lost);
  EXPECT_THAT(JudgeTask(facts).end.reason, HasSubstr("began on w4"));
}

TEST(WhyWaiting, IsSilentOfTasksThatWaitTheirTurn) {
  SlurmRecord record;
  for (const char* reason : {"", "None", "Resources", "Priority", "JobArrayTaskLimit"}) {
    record.reason = reason;
    EXPECT_EQ(WhyWaiting(record, "main", 10), "") << reason;
  }
}

TEST(WhyWaiting, NamesTheOptionToChange) {
  SlurmRecord record;
  for (const auto& [reason, words] :
       {std::pair<const char*, const char*>{"PartitionDown", "partition main is down"},
        {"PartitionTimeLimit", "less than the time limit of 10 min; lower --slurm-time-limit-min"},
        {"BadConstraints", "--slurm-cpus-per-task"},
        {"ReqNodeNotAvail", "sinfo -R"},
        {"QOSMaxJobsPerUserLimit", "--slurm-qos"},
        {"JobHeldAdmin", "scontrol release"},
        {"SomethingNew", "SomethingNew"}}) {
    record.reason = reason;
    EXPECT_THAT(WhyWaiting(record, "main", 10), HasSubstr(words));
  }
}

TEST(JudgeTask, NamesTheNodeAsFarAsItIsKnown) {
  TaskFacts facts = Ended("NODE_FAIL");
  facts.record->node = "(null)";
  facts.host = "w5";
  EXPECT_EQ(JudgeTask(facts).end.reason, "node w5 failed");
  facts.record->node = "";
  facts.host = "";
  EXPECT_EQ(JudgeTask(facts).end.reason, "its node failed");
  EXPECT_EQ(JudgeTask({}).end.reason, "Slurm knows a task no more whose end was not seen");
}

TEST(JudgeTask, EveryStateHasItsWords) {
  EXPECT_EQ(JudgeTask(Ended("REVOKED")).end.reason, "a task on node w2 was cancelled in Slurm, not by Weft");
  EXPECT_TRUE(JudgeTask(Ended("REVOKED")).end.lost);
  TaskFacts late = Ended("DEADLINE");
  EXPECT_EQ(JudgeTask(late).end.reason, "reached the time limit of its partition");
  EXPECT_EQ(JudgeTask(late).error->code(), "FAILED_PRECONDITION");
  EXPECT_FALSE(JudgeTask(late).end.lost);
  late.frames_finished = 1;
  late.time_limit_min = 1;
  EXPECT_EQ(JudgeTask(late).end.reason, "a task reached its time limit of 1 min after 1 frames");
  TaskFacts memory = Ended("OUT_OF_MEMORY");
  memory.memory_mib = 300, memory.log_file = "/log", memory.full_folder = "full";
  EXPECT_EQ(JudgeTask(memory).end.reason,
            "used more than its 300 MiB on node w2; raise --slurm-memory-mib of weftd; log /log");
  EXPECT_FALSE(JudgeTask(memory).end.lost);
  EXPECT_EQ(JudgeTask(Ended("FAILED", 7 << 8)).end.reason, "exit status 7 on node w2");
  // One that still runs has no end.
  EXPECT_TRUE(JudgeTask(Ended("RUNNING")).end.lost);
  EXPECT_THAT(JudgeTask(Ended("RUNNING")).end.reason, HasSubstr("whose end was not seen"));
}

TEST(JudgeTask, AWorkerThatFailsTellsItsStatusAndLog) {
  TaskFacts facts = EndedByItself(2, "NOT_FOUND");
  facts.last_words = "no rig";
  EXPECT_EQ(JudgeTask(facts).end.reason, "exit status 2 on node w1; its last output: no rig");
  EXPECT_TRUE(EndedByItself(facts));
  facts.error.reset();
  EXPECT_FALSE(EndedByItself(facts)) << "it says not why";
  EXPECT_FALSE(EndedByItself(TaskFacts()));
}

TEST(WhyWaiting, KnowsTheReasonsOfSlurm) {
  SlurmRecord record;
  for (const char* usual : {"Dependency", "BeginTime", "Cleaning", "Prolog", "NodeDown"}) {
    record.reason = usual;
    EXPECT_EQ(WhyWaiting(record, "", 0), "") << usual;
  }
  for (const auto& [reason, words] : {std::pair<const char*, const char*>{"PartitionInactive", "is down"},
                                      {"PartitionNodeLimit", "--slurm-option"},
                                      {"Nodes_required_for_job", "sinfo -R"},
                                      {"AssocGrpCpuLimit", "--slurm-account"},
                                      {"AccountNotAllowed", "--slurm-account"},
                                      {"InvalidQOS", "--slurm-qos"},
                                      {"InvalidAccount", "--slurm-qos"}}) {
    record.reason = reason;
    EXPECT_THAT(WhyWaiting(record, "", 0), HasSubstr(words)) << reason;
    EXPECT_THAT(WhyWaiting(record, "", 0), ::testing::StartsWith(std::string("waits for Slurm: ") + reason));
  }
  record.reason = "PartitionDown";
  EXPECT_THAT(WhyWaiting(record, "", 0), HasSubstr("the default partition is down"));
}

}  // namespace
}  // namespace weft
