// SlurmExecutor: what tasks and Slurm say, and how tasks end.
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "services/work/slurm/slurm_executor.h"
#include "services/work/slurm/slurm_run.h"

namespace weft {
namespace {

constexpr double kClockTolerance_s = 2;

bool EndsOfItself(const SlurmRecord& record) {
  return record.state == "COMPLETED" || record.state == "FAILED";
}

// Its worker had no time to write a last event.
bool WasKilled(const SlurmRecord& record) {
  constexpr int64_t kSignals = 0x7f;
  constexpr int64_t kNotStarted = 126;  // by a shell, and all beyond
  return (record.wait_status & kSignals) != 0 || (record.wait_status >> 8) >= kNotStarted;
}

}  // namespace

void SlurmExecutor::ReadEvents() {
  // Each look asks the file system for every task.
  constexpr std::chrono::milliseconds kPerTask{2};
  const Clock::time_point now = Clock::now();
  if (next_look_ && now < *next_look_) return;
  next_look_ = now + std::max(options_.event_period, kPerTask * static_cast<int>(runs_.size())) / 2;
  for (const std::unique_ptr<Run>& run : runs_) {
    if (!run->events || run->ended) continue;
    for (const v1::WorkerEvent& event : run->events->Read()) {
      run->heard = now;
      OnEvent(*run, event);
    }
  }
}

void SlurmExecutor::OnEvent(Run& run, const v1::WorkerEvent& event) {
  if (event.has_began()) {
    run.host = event.began().host();
    const int64_t now_ns = HostTime_ns();
    const double ahead_s = static_cast<double>(event.began().host_unix_ns() - now_ns) * 1e-9;
    run.queued_s =
        std::max(0.0, static_cast<double>(event.began().host_unix_ns() - run.submitted_unix_ns) * 1e-9);
    if (ahead_s > kClockTolerance_s && clock_noted_.insert(run.host).second) {
      run.listener.noted(absl::StrFormat(
          "the clock of node %s is %.0f s ahead of this machine's; have both follow one time server",
          run.host, ahead_s));
    }
    return;
  }
  if (event.has_finished()) run.finished.insert(event.finished().frame());
  if (event.has_ended()) {
    run.ended = event.ended();
    double& peak_mib = peak_mib_[run.task.job_id()];
    peak_mib = std::max(peak_mib, event.ended().peak_memory_mib());
  }
  if (event.has_error()) {
    run.error = event.error();
    v1::WorkerEvent told = event;
    if (!run.host.empty())
      told.mutable_error()->set_message(absl::StrCat(event.error().message(), " (on node ", run.host, ")"));
    return run.listener.event(told);
  }
  run.listener.event(event);
}

void SlurmExecutor::CancelStopped() {
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double> period(options_.query_s);
  std::map<Array*, std::vector<Run*>> asked;
  for (const std::unique_ptr<Run>& run : runs_) {
    if (!run->was_stopped || !run->array || run->ended) continue;
    if (run->cancelled_at && now - *run->cancelled_at < period) continue;
    asked[run->array.get()].push_back(run.get());
  }
  if (asked.empty()) return;
  std::vector<std::string> jobs;
  for (const auto& [array, runs] : asked) {
    const bool is_all = static_cast<int>(runs.size()) == array->unfinished;
    if (is_all) jobs.push_back(absl::StrCat(array->id));
    for (Run* run : runs) {
      run->cancelled_at = now;
      if (!is_all) jobs.push_back(absl::StrCat(array->id, "_", run->index));
    }
  }
  const absl::Status status = commands_.Cancel(jobs);
  if (!status.ok()) {
    ReportWaiting(absl::StrCat("Slurm does not answer, so its tasks are not confirmed as cancelled: ",
                               absl::string_view(status.message())));
  }
}

void SlurmExecutor::QueryIfSilent() {
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double> period(options_.query_s);
  if (last_query_ && now - *last_query_ < period) return;
  const bool is_needed =
      !knows_leftovers_ || std::ranges::any_of(runs_, [&](const std::unique_ptr<Run>& run) {
        if (!run->array || run->gone_at) return false;
        return now - run->heard >= period || run->cancelled_at || run->ended;
      });
  if (!is_needed) return;
  last_query_ = now;
  const absl::StatusOr<std::vector<SlurmRecord>> records = commands_.Query();
  if (!records.ok()) {
    ReportWaiting(absl::StrCat("Slurm does not answer; tasks that run go on, others wait: ",
                               absl::string_view(records.status().message())));
    return;
  }
  CancelLeftovers(*records);
  UseRecords(*records);
}

// Where one of ours cannot be read, or one of which nobody knows whose it is, those that are missing may be
// it.
bool SlurmExecutor::IsWhole(const std::vector<SlurmRecord>& records) const {
  return std::ranges::none_of(records, [this](const SlurmRecord& record) {
    const int64_t array_id = record.array_id > 0 ? record.array_id : record.job_id;
    return !record.fault.empty() && (array_id <= 0 || own_arrays_.contains(array_id));
  });
}

// Jobs with our tag that no run of ours knows: of an executor that was killed, or of an sbatch whose answer
// was lost.
void SlurmExecutor::CancelLeftovers(const std::vector<SlurmRecord>& records) {
  std::vector<std::string> left;
  {
    const MutexLock lock(mutex_);
    left.swap(unclaimed_);
  }
  const std::vector<std::string> unclaimed = left;
  for (const SlurmRecord& record : records) {
    if (record.comment != absl::StrCat("weft:", tag_) || HasEnded(record.state)) continue;
    const int64_t array_id = record.array_id > 0 ? record.array_id : record.job_id;
    if (array_id <= 0) continue;
    if (!own_arrays_.contains(array_id)) left.push_back(absl::StrCat(array_id));
  }
  std::ranges::sort(left);
  left.erase(std::unique(left.begin(), left.end()), left.end());
  if (left.empty() || commands_.Cancel(left).ok()) {
    knows_leftovers_ = true;
  } else {
    const MutexLock lock(mutex_);
    unclaimed_ = unclaimed;
  }
}

void SlurmExecutor::UseRecords(const std::vector<SlurmRecord>& records) {
  const Clock::time_point now = Clock::now();
  const bool is_whole = IsWhole(records);
  for (const std::unique_ptr<Run>& run : runs_) {
    if (!run->array || run->gone_at) continue;
    const SlurmRecord* record = FindElement(records, run->array->id, run->index);
    if (record == nullptr) {
      if (is_whole) run->gone_at = now;
      continue;
    }
    if (!record->fault.empty()) {
      run->listener.waits(absl::StrCat("what Slurm says of a task cannot be read: ", record->fault));
      continue;
    }
    run->record = *record;
    if (HasEnded(record->state)) {
      run->gone_at = now;
    } else if (record->state == "PENDING") {
      const std::string why = WhyWaiting(*record, options_.partition, options_.time_limit_min);
      if (!why.empty()) run->listener.waits(why);
    } else if (record->start_unix_s > 0) {
      run->queued_s = static_cast<double>(std::max<int64_t>(0, record->start_unix_s - record->submit_unix_s));
      const double silent_s =
          static_cast<double>(HostTime_ns()) * 1e-9 - static_cast<double>(record->start_unix_s);
      if (!run->events->exists() && silent_s > std::max(options_.lag_s, 5.0)) {
        run->listener.waits(
            absl::StrFormat("a task runs on %s for %.0f s, and nothing of it is seen in %s: the file system "
                            "lags, or the node "
                            "does not see that folder",
                            record->node, silent_s, run->array->folder.path()));
      }
    }
  }
}

bool SlurmExecutor::IsOver(const Run& run, Clock::time_point now) const {
  if (!run.array) return run.was_stopped;
  if (run.ended && EndedByItself(FactsOf(run))) return true;
  if (stop_by_ && now >= *stop_by_) return true;
  if (!run.gone_at) return false;
  // Whoever ended by itself has written so, which may be seen late. That holds for a task that Slurm forgot,
  // too.
  const bool is_last_word = run.record && HasEnded(run.record->state);
  const bool may_be_late = !run.ended && !run.was_stopped &&
                           (!is_last_word || (EndsOfItself(*run.record) && !WasKilled(*run.record)));
  return !may_be_late || now - *run.gone_at >= std::chrono::duration<double>(options_.lag_s);
}

TaskFacts SlurmExecutor::FactsOf(const Run& run) const {
  TaskFacts facts;
  facts.was_stopped = run.was_stopped;
  facts.ended = run.ended;
  facts.error = run.error;
  facts.frames_finished = static_cast<int>(run.finished.size());
  facts.record = run.record;
  facts.host = run.host;
  facts.time_limit_min = options_.time_limit_min;
  facts.lag_s = options_.lag_s;
  if (run.array) facts.memory_mib = run.array->memory_mib;
  return facts;
}

void SlurmExecutor::Conclude() {
  const Clock::time_point now = Clock::now();
  for (const std::unique_ptr<Run>& run : runs_) {
    if (run->over || !IsOver(*run, now)) continue;
    TaskFacts facts = FactsOf(*run);
    if (run->array && !facts.was_stopped) {
      const TaskFolder& folder = run->array->folder;
      facts.last_words = folder.LastWords(run->index);
      facts.log_file = folder.LogFile(run->index);
      if (!facts.ended) facts.full_folder = std::string(folder.CheckRoom().message());
    }
    if (facts.record && facts.record->state == "OUT_OF_MEMORY" && options_.memory_mib == 0) {
      double& peak_mib = peak_mib_[run->task.job_id()];
      peak_mib = std::max(peak_mib, static_cast<double>(facts.memory_mib));
    }
    End(*run, JudgeTask(facts));
  }
  RemoveEnded();
}

// Frees the slot before telling, so that the listener can start the next task.
void SlurmExecutor::End(Run& run, const TaskVerdict& verdict) {
  run.over = true;
  if (run.array) {
    run.array->folder.Remove(run.index);
    if (--run.array->unfinished == 0) run.array->folder.RemoveIfEmpty();
  }
  {
    const MutexLock lock(mutex_);
    std::erase(taken_, run.task.id());
  }
  if (verdict.error) {
    v1::WorkerEvent event;
    *event.mutable_error() = *verdict.error;
    run.listener.event(event);
  }
  TaskEnd end = verdict.end;
  end.queued_s = run.queued_s;
  run.listener.ended(end);
}

}  // namespace weft
