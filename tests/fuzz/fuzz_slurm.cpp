// What Slurm's programs print. Whatever they say, every job that is accepted has an id and a state, or a
// fault.
#include "services/work/slurm/slurm_state.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

void Check(const std::vector<weft::SlurmRecord>& records) {
  for (const weft::SlurmRecord& record : records) {
    if (!record.fault.empty()) continue;
    weft::FuzzRequire(record.job_id > 0 && !record.state.empty());
    const int64_t array = record.array_id > 0 ? record.array_id : record.job_id;
    if (record.index) weft::FuzzRequire(weft::FindElement(records, array, *record.index) != nullptr);
    for (const int64_t index : record.waiting) weft::FuzzRequire(index >= 0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto records = weft::ParseSqueue(text); records.ok()) Check(*records);
  if (const auto records = weft::ParseScontrolJobs(text); records.ok()) Check(*records);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {
      R"({"errors": [], "jobs": [{"job_id": 13, "array_job_id": 1, "array_task_id": 0, "job_state": "RUNNING",
"state_reason": "None", "exit_code": 0, "batch_host": "w1", "submit_time": 1795578953, "comment": "weft:1"},
{"job_id": 1, "array_job_id": 1, "array_task_id": null, "array_task_string": "2-5,7%2", "job_state": "PENDING"}]})",
      R"({"jobs": [{"job_id": 7, "array_job_id": {"set": true, "number": 5}, "job_state": ["RUNNING"],
"array_task_id": {"set": true, "number": 2}, "exit_code": {"return_code": {"number": 1}, "signal": {"id": {"number": 9}}}}]})",
      R"({"errors": [{"description": "Failed while looking for jobs", "error_number": -1}], "jobs": []})",
      "JobId=13 ArrayJobId=1 ArrayTaskId=0 JobName=weft\n   JobState=RUNNING Reason=None Dependency=(null)\n"
      "   BatchHost=w1 ExitCode=0:9\n\nJobId=1 ArrayJobId=1 ArrayTaskId=2-5%2 JobName=weft\n"
      "   JobState=PENDING Reason=Resources\n"};
}
