#include "services/work/slurm/task_end.h"

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/ground/process/exit_status.h"

namespace weft {
namespace {

constexpr char kRemedyForMemory[] = "raise --slurm-memory-mib of weftd";

TaskVerdict Lost(std::string reason) {
  TaskVerdict verdict;
  verdict.end.lost = true;
  verdict.end.reason = std::move(reason);
  return verdict;
}

TaskVerdict Failed(std::string reason) {
  TaskVerdict verdict;
  verdict.end.reason = std::move(reason);
  return verdict;
}

std::string NodeOf(const TaskFacts& facts) {
  std::string node = facts.record ? facts.record->node : "";
  if (node.empty() || node == "(null)") node = facts.host;
  return node.empty() ? "its node" : absl::StrCat("node ", node);
}

std::string Log(const TaskFacts& facts) {
  return absl::StrCat(facts.last_words.empty() ? "" : absl::StrCat("; its last output: ", facts.last_words),
                      facts.log_file.empty() ? "" : absl::StrCat("; log ", facts.log_file));
}

TaskVerdict TimeLimit(const TaskFacts& facts) {
  const std::string limit = facts.time_limit_min > 0
                                ? absl::StrCat("its time limit of ", facts.time_limit_min, " min")
                                : std::string("the time limit of its partition");
  if (facts.frames_finished > 0)
    return Lost(absl::StrCat("a task reached ", limit, " after ", facts.frames_finished, " frames"));
  TaskVerdict verdict = Failed(absl::StrCat("reached ", limit));
  verdict.error.emplace();
  verdict.error->set_code("FAILED_PRECONDITION");
  verdict.error->set_message(
      absl::StrCat("a task reached ", limit,
                   " before its first frame was done; raise --slurm-time-limit-min of weftd, then `weft job "
                   "retry` goes on"));
  return verdict;
}

TaskVerdict ByState(const TaskFacts& facts) {
  const std::string& state = facts.record->state;
  if (state == "NODE_FAIL" || state == "BOOT_FAIL") return Lost(absl::StrCat(NodeOf(facts), " failed"));
  if (state == "PREEMPTED") return Lost(absl::StrCat("a job of higher priority took ", NodeOf(facts)));
  if (state == "TIMEOUT" || state == "DEADLINE") return TimeLimit(facts);
  if (state == "CANCELLED" || state == "REVOKED")
    return Lost(absl::StrCat("a task on ", NodeOf(facts), " was cancelled in Slurm, not by Weft"));
  if (state == "OUT_OF_MEMORY") {
    return Failed(absl::StrCat("used more than its ", facts.memory_mib, " MiB on ", NodeOf(facts), "; ",
                               kRemedyForMemory, Log(facts)));
  }
  if (!facts.full_folder.empty()) {
    TaskVerdict verdict = Failed(facts.full_folder);
    verdict.end.refused = true;
    return verdict;
  }
  if (state == "COMPLETED") {
    return Lost(absl::StrCat("a task ended on ", NodeOf(facts), ", but its last events were not seen within ",
                             facts.lag_s,
                             " s: the file system of --slurm-folder lags, or the node does not "
                             "see that folder; raise --slurm-lag-s"));
  }
  return Failed(absl::StrCat(DescribeExit(static_cast<int>(facts.record->wait_status)), " on ", NodeOf(facts),
                             Log(facts)));
}

}  // namespace

bool EndedByItself(const TaskFacts& facts) {
  if (!facts.ended) return false;
  return facts.was_stopped || facts.ended->exit_status() == kExitDone ||
         (facts.error && facts.error->code() != "CANCELLED");
}

TaskVerdict JudgeTask(const TaskFacts& facts) {
  if (facts.was_stopped) return Failed("stopped");
  if (EndedByItself(facts)) {
    if (facts.ended->exit_status() != kExitDone)
      return Failed(
          absl::StrCat("exit status ", facts.ended->exit_status(), " on ", NodeOf(facts), Log(facts)));
    TaskVerdict verdict;
    verdict.end.clean = true;
    return verdict;
  }
  if (facts.record && HasEnded(facts.record->state)) return ByState(facts);
  return Lost(absl::StrCat("Slurm knows a task no more whose end was not seen",
                           facts.host.empty() ? "" : absl::StrCat(" (it began on ", facts.host, ")")));
}

std::string WhyWaiting(const SlurmRecord& record, const std::string& partition, int time_limit_min) {
  const std::string where =
      partition.empty() ? std::string("the default partition") : absl::StrCat("partition ", partition);
  const absl::string_view reason = record.reason;
  for (const char* usual : {"None", "Resources", "Priority", "JobArrayTaskLimit", "Dependency", "BeginTime",
                            "Cleaning", "Prolog", "NodeDown"}) {
    if (reason == usual || reason.empty()) return "";
  }
  std::string why;
  if (absl::StartsWith(reason, "PartitionTimeLimit")) {
    why = absl::StrCat(where, " permits less than the time limit of ", time_limit_min,
                       " min; lower --slurm-time-limit-min of weftd");
  } else if (absl::StartsWith(reason, "PartitionDown") || absl::StartsWith(reason, "PartitionInactive")) {
    why = absl::StrCat(where, " is down; its administrator starts it, or give another --slurm-partition");
  } else if (absl::StartsWith(reason, "BadConstraints") || absl::StartsWith(reason, "PartitionNodeLimit")) {
    why = absl::StrCat(
        "no node of ", where,
        " has what a task asks for; lower --slurm-cpus-per-task or --slurm-memory-mib, or change "
        "--slurm-option");
  } else if (absl::StartsWith(reason, "ReqNodeNotAvail") || absl::StartsWith(reason, "Nodes_required")) {
    why = absl::StrCat("the nodes of ", where, " are down, drained or reserved; `sinfo -R` says why");
  } else if (absl::StartsWith(reason, "JobHeld")) {
    why = "the tasks are held; `scontrol release` lets them go on";
  } else if (absl::StartsWith(reason, "QOS") || absl::StartsWith(reason, "Assoc") ||
             absl::StartsWith(reason, "Account") || absl::StartsWith(reason, "InvalidQOS") ||
             absl::StartsWith(reason, "InvalidAccount")) {
    why = "a limit of the account or quality of service; --slurm-account and --slurm-qos choose others";
  } else {
    why = "see the manual of squeue, JOB REASON CODES";
  }
  return absl::StrCat("waits for Slurm: ", reason, ": ", why);
}

}  // namespace weft
