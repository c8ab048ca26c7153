#include "services/work/slurm/slurm_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Output of Slurm 22.05.8 with four nodes, see data/README.md.
std::string Recorded(const std::string& name) {
  return *ReadWholeFile(std::string(SLURM_TEST_DATA) + "/" + name);
}

std::string StateOf(const std::vector<SlurmRecord>& records, int64_t array, int64_t index) {
  const SlurmRecord* record = FindElement(records, array, index);
  return record == nullptr ? "none" : record->state;
}

TEST(ParseSqueue, ReadsArraysThatRunInPart) {
  const auto records = ParseSqueue(Recorded("squeue_mixed.json"));
  ASSERT_TRUE(records.ok()) << records.status();
  ASSERT_EQ(records->size(), 11u);
  EXPECT_EQ(StateOf(*records, 1, 0), "RUNNING");
  EXPECT_EQ(StateOf(*records, 1, 1), "CANCELLED");
  EXPECT_EQ(StateOf(*records, 1, 4), "RUNNING");
  EXPECT_EQ(StateOf(*records, 1, 6), "PENDING");
  EXPECT_EQ(StateOf(*records, 1, 9), "PENDING");
  // Cancelled while they waited: Slurm forgets them at once.
  EXPECT_EQ(StateOf(*records, 1, 5), "none");
  EXPECT_EQ(StateOf(*records, 1, 8), "none");
  EXPECT_EQ(StateOf(*records, 1, 10), "none");
  const SlurmRecord& running = *FindElement(*records, 1, 0);
  EXPECT_EQ(running.node, "w1");
  EXPECT_EQ(running.comment, "weft:tag");
  EXPECT_EQ(running.start_unix_s - running.submit_unix_s, 3);
}

TEST(ParseSqueue, ReadsJobsThatAreNoArrays) {
  const auto records = ParseSqueue(Recorded("squeue_mixed.json"));
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(FindElement(*records, 4, 0)->reason, "PartitionDown");
  EXPECT_EQ(FindElement(*records, 5, 0)->reason, "PartitionTimeLimit");
  EXPECT_EQ(FindElement(*records, 6, 0)->reason, "BadConstraints");
  EXPECT_EQ(FindElement(*records, 6, 1), nullptr);
}

TEST(ParseSqueue, TellsLostNodesFromPreemption) {
  const auto records = ParseSqueue(Recorded("squeue_ended.json"));
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(StateOf(*records, 1, 0), "NODE_FAIL");
  EXPECT_EQ(StateOf(*records, 1, 2), "PREEMPTED");
  EXPECT_TRUE(HasEnded("NODE_FAIL"));
  EXPECT_TRUE(HasEnded("PREEMPTED"));
  EXPECT_FALSE(HasEnded("COMPLETING"));
  EXPECT_FALSE(HasEnded("PENDING"));
}

TEST(ParseSqueue, SaysThatTheControllerIsAway) {
  const absl::Status status = ParseSqueue(Recorded("squeue_no_controller.json")).status();
  EXPECT_TRUE(absl::IsUnavailable(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("Failed while looking for jobs"));
}

TEST(ParseSqueue, ReadsLaterVersions) {
  // As documented for data_parser/v0.0.40 of Slurm 23.11.
  const auto records = ParseSqueue(R"({"jobs": [{"job_id": 7, "array_job_id": {"set": true, "infinite": false,
    "number": 5}, "array_task_id": {"set": true, "infinite": false, "number": 2}, "array_task_string": "",
    "job_state": ["RUNNING", "COMPLETING"], "state_reason": "None", "batch_host": "n1",
    "exit_code": {"status": ["SIGNALED"], "return_code": {"set": true, "number": 1},
    "signal": {"id": {"set": true, "number": 9}}}}, {"job_id": 8, "array_job_id": {"set": true, "number": 0},
    "array_task_id": {"set": false, "infinite": false, "number": 0}, "job_state": ["COMPLETED"]}], "errors": []})");
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(StateOf(*records, 5, 2), "RUNNING");
  EXPECT_EQ(FindElement(*records, 5, 2)->wait_status, 1 << 8 | 9);
  EXPECT_EQ(StateOf(*records, 8, 0), "COMPLETED");
}

TEST(ParseSqueue, RefusesWhatIsNoAnswer) {
  for (const char* json : {"", "[]", "{}", R"({"jobs": 3})", R"({"jobs": {}})"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ParseSqueue(json).status())) << json;
  }
}

TEST(ParseSqueue, ARecordThatCannotBeReadHasAFault) {
  for (const char* record :
       {R"({"job_id": 3})", "3", R"({"job_id": "3", "job_state": "RUNNING"})",
        R"({"job_id": 3, "job_state": 7})",
        R"({"job_id": 3, "array_job_id": 3, "array_task_string": "5-", "job_state": "PENDING"})"}) {
    const auto records = ParseSqueue(
        absl::StrCat(R"({"jobs": [)", record, R"(, {"job_id": 8, "job_state": "RUNNING"}], "errors": []})"));
    ASSERT_TRUE(records.ok()) << record << records.status();
    ASSERT_EQ(records->size(), 2u);
    EXPECT_FALSE(records->front().fault.empty()) << record;
    EXPECT_EQ(records->back().fault, "");
    EXPECT_EQ(StateOf(*records, 8, 0), "RUNNING");
  }
}

// As Slurm 22.05 prints the waiting elements of
// --array=3,7,12,19-20,28,33,41,47,58,60,77,81,90,95,102,110,131,140,155,171.
TEST(ParseSqueue, ReadsListsOfElementsThatAreCut) {
  const auto records = ParseSqueue(R"({"jobs": [{"job_id": 5, "array_job_id": 5, "job_state": "PENDING",
    "array_task_string": "3,7,12,19-20,28,33,41,47,58,60,77,81,90,95,102,110,131,1..."}], "errors": []})");
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(records->front().fault, "");
  EXPECT_EQ(StateOf(*records, 5, 20), "PENDING");
  EXPECT_EQ(StateOf(*records, 5, 131), "PENDING");
  EXPECT_EQ(StateOf(*records, 5, 21), "none");
  EXPECT_EQ(StateOf(*records, 5, 171), "PENDING") << "it may be";
}

TEST(ParseScontrolJobs, AgreesWithSqueue) {
  const auto squeue = ParseSqueue(Recorded("squeue_mixed.json"));
  const auto scontrol = ParseScontrolJobs(Recorded("scontrol_mixed.txt"));
  ASSERT_TRUE(squeue.ok()) << squeue.status();
  ASSERT_TRUE(scontrol.ok()) << scontrol.status();
  ASSERT_EQ(squeue->size(), scontrol->size());
  for (const SlurmRecord& one : *squeue) {
    const auto other = std::find_if(scontrol->begin(), scontrol->end(), [&one](const SlurmRecord& record) {
      return record.job_id == one.job_id;
    });
    ASSERT_NE(other, scontrol->end()) << one.job_id;
    EXPECT_EQ(other->state, one.state);
    EXPECT_EQ(other->array_id, one.array_id);
    EXPECT_EQ(other->index, one.index);
    EXPECT_EQ(other->waiting, one.waiting);
    EXPECT_EQ(other->wait_status, one.wait_status);
    EXPECT_EQ(other->node, one.node);
    EXPECT_EQ(other->name, one.name);
  }
}

TEST(ParseScontrolJobs, KnowsAnEmptyCluster) {
  EXPECT_THAT(*ParseScontrolJobs("No jobs in the system\n"), IsEmpty());
  EXPECT_FALSE(ParseScontrolJobs("slurm_load_jobs error: Unable to contact slurm controller\n").ok());
  const auto stateless = ParseScontrolJobs("JobId=7 JobName=a\nJobId=8 JobState=RUNNING\n");
  ASSERT_TRUE(stateless.ok()) << stateless.status();
  EXPECT_FALSE(stateless->front().fault.empty());
  EXPECT_EQ(StateOf(*stateless, 8, 0), "RUNNING");
}

TEST(ParseArrayIndexes, ReadsListsRangesAndSteps) {
  EXPECT_THAT(*ParseArrayIndexes("6-7,9"), ElementsAre(6, 7, 9));
  EXPECT_THAT(*ParseArrayIndexes("0-10:4,20%3"), ElementsAre(0, 4, 8, 20));
  for (const char* wrong :
       {"", "-1", "3-", "5-3", "1,,2", "1-5:0", "0-9999999999", "0-2000000", "1,...", "a"}) {
    EXPECT_FALSE(ParseArrayIndexes(wrong).ok()) << wrong;
  }
}

TEST(HasEnded, IsFalseOfEveryStateThatGoesOn) {
  for (const char* going : {"PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "SUSPENDED", "STOPPED",
                            "REQUEUED", "REQUEUE_HOLD", "RESIZING", "SIGNALING", "STAGE_OUT"})
    EXPECT_FALSE(HasEnded(going)) << going;
  for (const char* ended : {"COMPLETED", "FAILED", "TIMEOUT", "OUT_OF_MEMORY", "CANCELLED", "A_NEW_ONE", ""})
    EXPECT_TRUE(HasEnded(ended)) << ended;
}

// The only record of such an answer.
SlurmRecord RecordOf(const std::string& fields) {
  const auto records = ParseSqueue(absl::StrCat(R"({"jobs": [{)", fields, R"(}], "errors": []})"));
  EXPECT_TRUE(records.ok()) << records.status();
  return records.ok() && records->size() == 1 ? records->front() : SlurmRecord();
}

TEST(ParseSqueue, ReadsAllThatIsWanted) {
  const SlurmRecord record = RecordOf(R"("job_id": 12, "array_job_id": 10, "array_task_id": 2,
    "array_task_string": "3-4", "job_state": "FAILED", "state_reason": "NonZeroExitCode", "batch_host": "w3",
    "comment": "weft:tag", "name": "weft-job", "exit_code": 256, "submit_time": 11, "start_time": 13,
    "end_time": 17)");
  EXPECT_EQ(record.fault, "");
  EXPECT_EQ(record.job_id, 12);
  EXPECT_EQ(record.array_id, 10);
  EXPECT_EQ(record.index, 2);
  EXPECT_TRUE(record.waiting.empty()) << "an element that has begun waits for nothing";
  EXPECT_EQ(record.state, "FAILED");
  EXPECT_EQ(record.reason, "NonZeroExitCode");
  EXPECT_EQ(record.node, "w3");
  EXPECT_EQ(record.comment, "weft:tag");
  EXPECT_EQ(record.name, "weft-job");
  EXPECT_EQ(record.wait_status, 256);
  EXPECT_EQ(record.submit_unix_s, 11);
  EXPECT_EQ(record.start_unix_s, 13);
  EXPECT_EQ(record.end_unix_s, 17);
}

TEST(ParseSqueue, WhatIsNotSetIsNothing) {
  const SlurmRecord record = RecordOf(R"("job_id": 12, "job_state": "RUNNING", "array_task_id": 4,
    "batch_host": null, "state_reason": [], "submit_time": null, "start_time": {"set": false, "number": 9},
    "end_time": {"number": 9})");
  EXPECT_EQ(record.fault, "");
  EXPECT_EQ(record.node, "");
  EXPECT_EQ(record.reason, "");
  EXPECT_EQ(record.submit_unix_s, 0);
  EXPECT_EQ(record.start_unix_s, 0);
  EXPECT_EQ(record.end_unix_s, 9);
  EXPECT_EQ(record.index, std::nullopt) << "it is of no array";
}

TEST(ParseSqueue, ExitCodesOfAllVersions) {
  EXPECT_EQ(
      RecordOf(R"("job_id": 1, "job_state": "FAILED", "exit_code": {"set": true, "number": 9})").wait_status,
      9);
  const auto later = [](int code, int signal) {
    return RecordOf(
               absl::StrCat(R"("job_id": 1, "job_state": "FAILED", "exit_code": {"return_code": {"set": true,
      "number": )",
                            code, R"(}, "signal": {"id": {"set": true, "number": )", signal, "}}}"))
        .wait_status;
  };
  EXPECT_EQ(later(3, 0), 3 << 8);
  EXPECT_EQ(later(0, 11), 11);
  EXPECT_EQ(later(0x1ff, 0x8b), 0xff << 8 | 0x0b) << "as waitpid has them";
  EXPECT_EQ(
      RecordOf(R"("job_id": 1, "job_state": "FAILED", "exit_code": {"return_code": 3, "signal": "none"})")
          .wait_status,
      3 << 8);
}

TEST(ParseSqueue, FaultsNameTheField) {
  for (const char* field :
       {"job_id", "array_job_id", "array_task_id", "exit_code", "submit_time", "start_time", "end_time",
        "state_reason", "batch_host", "comment", "name", "array_task_string"}) {
    const bool is_id = std::string(field) == "job_id";
    const std::string state = absl::StrCat(is_id ? "" : R"("job_id": 1, )", R"("job_state": "RUNNING", )");
    EXPECT_THAT(RecordOf(absl::StrCat(state, "\"", field, R"(": true)")).fault,
                HasSubstr(absl::StrCat(field, " has a value of an unknown kind")));
  }
  EXPECT_THAT(RecordOf(R"("job_id": 9e15, "job_state": "RUNNING")").fault, HasSubstr("job_id has"));
  EXPECT_EQ(RecordOf(R"("job_id": 8e15, "job_state": "RUNNING")").fault, "");
  for (const char* missing : {R"("job_id": 0, "job_state": "RUNNING")", R"("job_id": 3, "job_state": "")"})
    EXPECT_EQ(RecordOf(missing).fault, "squeue: a job without job_id or job_state");
}

TEST(ParseSqueue, WordsOfTheControllerAreTold) {
  const auto words_of = [](const std::string& errors) {
    return ParseSqueue(absl::StrCat(R"({"jobs": [], "errors": [)", errors, "]}")).status();
  };
  EXPECT_EQ(words_of(R"({"description": "no slurmctld"})"), absl::UnavailableError("squeue: no slurmctld"));
  EXPECT_EQ(words_of("{}"), absl::UnavailableError("squeue: an error"));
  EXPECT_TRUE(absl::IsInvalidArgument(words_of(R"({"description": 3})")));
}

TEST(ParseSqueue, AListMayBeCutWithinItsFirstNumber) {
  const SlurmRecord record = RecordOf(R"("job_id": 5, "array_job_id": 5, "job_state": "PENDING",
    "array_task_string": "1...%4")");
  EXPECT_EQ(record.fault, "");
  EXPECT_TRUE(record.waiting_is_cut);
  EXPECT_TRUE(record.waiting.empty());
  EXPECT_NE(FindElement({record}, 5, 0), nullptr) << "it may be any";
  EXPECT_EQ(FindElement({record}, 6, 0), nullptr);
}

TEST(FindElement, PrefersAnElementThatHasBegunToThoseThatWait) {
  SlurmRecord waits, runs, other;
  waits.job_id = 5, waits.array_id = 5, waits.waiting = {1, 2}, waits.state = "PENDING";
  runs.job_id = 6, runs.array_id = 5, runs.index = 1, runs.state = "RUNNING";
  other.job_id = 7, other.array_id = 7, other.index = 2;
  EXPECT_EQ(StateOf({waits, runs, other}, 5, 1), "RUNNING");
  EXPECT_EQ(StateOf({runs, waits, other}, 5, 1), "RUNNING");
  EXPECT_EQ(StateOf({waits, runs, other}, 5, 2), "PENDING");
  EXPECT_EQ(StateOf({waits, runs, other}, 5, 3), "none");
  EXPECT_EQ(StateOf({waits, runs, other}, 6, 0), "none") << "an element is no job of its own";
}

TEST(ParseScontrolJobs, ReadsAllThatIsWanted) {
  const auto records = ParseScontrolJobs(
      "JobId=12 ArrayJobId=10 ArrayTaskId=2 JobName=weft-job\n   JobState=FAILED Reason=NonZeroExitCode "
      "Dependency=(null)\n   ExitCode=3:9\n   BatchHost=w3\n   Comment=weft:tag\n\nJobId=10 ArrayJobId=10 "
      "ArrayTaskId=3-5,8%2 JobName=weft-job JobState=PENDING\n");
  ASSERT_TRUE(records.ok()) << records.status();
  ASSERT_EQ(records->size(), 2u);
  const SlurmRecord& record = records->front();
  EXPECT_EQ(record.fault, "");
  EXPECT_EQ(record.job_id, 12);
  EXPECT_EQ(record.array_id, 10);
  EXPECT_EQ(record.index, 2);
  EXPECT_EQ(record.name, "weft-job");
  EXPECT_EQ(record.state, "FAILED");
  EXPECT_EQ(record.reason, "NonZeroExitCode");
  EXPECT_EQ(record.node, "w3");
  EXPECT_EQ(record.comment, "weft:tag");
  EXPECT_EQ(record.wait_status, 3 << 8 | 9);
  EXPECT_THAT(records->back().waiting, ElementsAre(3, 4, 5, 8));
  EXPECT_FALSE(records->back().index);
}

TEST(ParseScontrolJobs, FaultsNameTheWord) {
  const auto fault_of = [](const std::string& words) {
    const auto records = ParseScontrolJobs(absl::StrCat("JobId=7 JobState=RUNNING ", words));
    return records.ok() ? records->front().fault : std::string(records.status().message());
  };
  EXPECT_EQ(fault_of("ArrayJobId=0"), "");
  EXPECT_EQ(fault_of("ArrayJobId=x"), "scontrol: ArrayJobId=x is no number");
  for (const char* code : {"ExitCode=1", "ExitCode=a:1", "ExitCode=1:b"})
    EXPECT_EQ(fault_of(code), absl::StrCat("scontrol: ", code));
  EXPECT_EQ(fault_of("ArrayTaskId=2"), "scontrol: ArrayTaskId without ArrayJobId");
  EXPECT_THAT(fault_of("ArrayJobId=7 ArrayTaskId=-2"), HasSubstr("\"-2\" cannot be read"));
  for (const char* id : {"JobId=x", "JobId=0", "JobId=-1"})
    EXPECT_TRUE(absl::IsInvalidArgument(ParseScontrolJobs(id).status())) << id;
  EXPECT_TRUE(absl::IsInvalidArgument(ParseScontrolJobs("JobState=RUNNING JobId=7").status()));
}

TEST(ParseArrayIndexes, HasLimits) {
  EXPECT_THAT(*ParseArrayIndexes("5-5"), ElementsAre(5));
  EXPECT_THAT(*ParseArrayIndexes("0"), ElementsAre(0));
  EXPECT_THAT(*ParseArrayIndexes("2-9:3"), ElementsAre(2, 5, 8));
  EXPECT_THAT(*ParseArrayIndexes("2147483647"), ElementsAre(2147483647));
  EXPECT_EQ(ParseArrayIndexes("0-999999")->size(), 1'000'000u);
  EXPECT_EQ(ParseArrayIndexes("0-1999999:2")->size(), 1'000'000u);
  for (const char* wrong : {"0-1000000", "0-999999,5", "2147483648", "1-2-3", "1:2:3", "1-5:-1", "1-5:x"})
    EXPECT_FALSE(ParseArrayIndexes(wrong).ok()) << wrong;
  EXPECT_EQ(ParseArrayIndexes("x%2").status().message(), "array indexes \"x%2\" cannot be read");
}

}  // namespace
}  // namespace weft
