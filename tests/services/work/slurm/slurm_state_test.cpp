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

}  // namespace
}  // namespace weft
