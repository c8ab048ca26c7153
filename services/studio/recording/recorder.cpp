#include "services/studio/recording/recorder.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "base/stopwatch.h"
#include "services/studio/recording/set_fault.h"

namespace weft {
namespace {

// A set on its way to the disk. Each writer does its cameras; the last one completes it.
struct Job {
  RawFrameSet set;
  uint64_t bytes = 0;
  std::atomic<int> writers_left = 0;
  std::atomic<bool> is_lost = false;
};

}  // namespace

absl::Status RecorderOptions::Validate() const {
  if (writers < 1 || writers > 64) return absl::InvalidArgumentError("writers must be 1 to 64");
  if (flush_interval_ms < 1) return absl::InvalidArgumentError("flush_interval_ms must be positive");
  if (slow_write_ms < 1) return absl::InvalidArgumentError("slow_write_ms must be positive");
  if (stop_timeout_ms < 1) return absl::InvalidArgumentError("stop_timeout_ms must be positive");
  return take.stream.Validate();
}

// Outlives the recorder while a thread of it waits for a disk that does not answer.
struct Recorder::Shared {
  Shared(std::unique_ptr<TakeWriter> files, RecorderOptions with, Acknowledged tell)
      : take(std::move(files)),
        options(std::move(with)),
        acknowledged(std::move(tell)),
        queues(options.writers),
        writers_running(queues.size()) {}

  const std::unique_ptr<TakeWriter> take;
  const RecorderOptions options;
  const Acknowledged acknowledged;

  mutable Mutex mutex;
  std::condition_variable_any changed;
  std::vector<std::deque<std::shared_ptr<Job>>> queues ABSL_GUARDED_BY(mutex);  // of each writer
  // Sets that wait for the next flush, and their lines.
  std::vector<LedgerEntry> written ABSL_GUARDED_BY(mutex);
  std::vector<LedgerEntry> events ABSL_GUARDED_BY(mutex);  // drops and notes that wait for it
  std::optional<uint64_t> last_offered;                    // of the thread that offers
  std::optional<uint64_t> last_written ABSL_GUARDED_BY(mutex);
  std::optional<uint64_t> last_acknowledged ABSL_GUARDED_BY(mutex);
  RecorderCounters counters ABSL_GUARDED_BY(mutex);
  absl::Status failure ABSL_GUARDED_BY(mutex);  // of the first write that failed
  bool stopping ABSL_GUARDED_BY(mutex) = false;
  uint64_t progress ABSL_GUARDED_BY(mutex) = 0;
  size_t writers_running ABSL_GUARDED_BY(mutex);
  bool flusher_running ABSL_GUARDED_BY(mutex) = true;
  std::vector<std::thread> threads;  // of whoever starts and stops it
  bool stopped ABSL_GUARDED_BY(mutex) = false;
  absl::Status close_status ABSL_GUARDED_BY(mutex);

  void WriterLoop(size_t writer);
  void FlusherLoop();

 private:
  void WriteJob(Job& job, size_t writer);
  void Complete(const Job& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
  bool Flush();
  void DropWritten();
  TakeEnd End(const absl::Status& status) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
  void CheckDisk();
  void Close();

 public:
  void StopForRoom() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
  void Drop(uint64_t first_set, uint64_t last_set, int64_t device_time_ns, const std::string& cause)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
  void Fail(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
};

void Recorder::Shared::Drop(uint64_t first_set, uint64_t last_set, int64_t device_time_ns,
                            const std::string& cause) {
  counters.sets_dropped += last_set - first_set + 1;
  if (!events.empty()) {
    LedgerEntry& last = events.back();
    if (last.event == LedgerEvent::kDropped && last.last_set + 1 == first_set && last.cause == cause) {
      last.last_set = last_set;
      return;
    }
  }
  events.push_back({LedgerEvent::kDropped, first_set, last_set, device_time_ns, HostTime_ns(), "", cause});
}

void Recorder::Shared::Fail(const absl::Status& status) {
  failure.Update(status);
  if (counters.stop_cause.empty()) {
    counters.stop_cause = std::string(status.message());
    events.push_back(
        {LedgerEvent::kNote, 0, 0, 0, HostTime_ns(), "", "recording stopped: " + counters.stop_cause});
  }
  changed.notify_all();
}

void Recorder::Shared::WriteJob(Job& job, size_t writer) {
  for (size_t camera = writer; camera < take->camera_ids().size(); camera += options.writers) {
    const Stopwatch watch;
    const absl::Status status = take->Append(camera, job.set);
    const double took_ms = watch.Ms();
    const MutexLock lock(mutex);
    ++progress;
    if (!status.ok()) {
      job.is_lost = true;
      Fail(status);
      return;
    }
    if (took_ms > options.slow_write_ms) {
      events.push_back({LedgerEvent::kNote, job.set.number, job.set.number, job.set.device_time_ns,
                        HostTime_ns(), take->camera_ids()[camera],
                        absl::StrFormat("slow disk: writing the frame took %.1f s", took_ms / 1000)});
    }
  }
}

void Recorder::Shared::Complete(const Job& job) {
  counters.queued_bytes -= job.bytes;
  ++progress;
  if (job.is_lost) {
    Drop(job.set.number, job.set.number, job.set.device_time_ns,
         absl::StrCat("recording stopped: ", counters.stop_cause));
  } else {
    for (LedgerEntry& entry : EntriesOfRecorded(job.set, HostTime_ns())) written.push_back(std::move(entry));
    last_written = job.set.number;
    counters.bytes_written += job.bytes;
  }
  changed.notify_all();
}

void Recorder::Shared::WriterLoop(size_t writer) {
  MutexLock lock(mutex);
  while (true) {
    changed.wait(lock,
                 [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) { return stopping || !queues[writer].empty(); });
    if (queues[writer].empty()) break;
    const std::shared_ptr<Job> job = std::move(queues[writer].front());
    queues[writer].pop_front();
    if (!failure.ok()) {
      job->is_lost = true;
    } else {
      lock.unlock();
      WriteJob(*job, writer);
      lock.lock();
    }
    if (--job->writers_left == 0) Complete(*job);
  }
  --writers_running;
  changed.notify_all();
}

// False: the disk did not take it; sets and lines wait for another try.
bool Recorder::Shared::Flush() {
  std::vector<LedgerEntry> sets, others;
  std::optional<uint64_t> last;
  {
    const MutexLock lock(mutex);
    sets.swap(written);
    others.swap(events);
    last = last_written;
  }
  if (sets.empty() && others.empty()) return true;
  std::vector<LedgerEntry> entries = sets;
  entries.insert(entries.end(), others.begin(), others.end());
  const absl::Status status = take->Commit(sets.empty() ? std::nullopt : last, entries);
  MutexLock lock(mutex);
  ++progress;
  if (!status.ok()) {
    written.insert(written.begin(), sets.begin(), sets.end());
    events.insert(events.begin(), others.begin(), others.end());
    Fail(status);
    return false;
  }
  if (!sets.empty()) last_acknowledged = last;
  for (const LedgerEntry& entry : sets) {
    counters.sets_recorded += entry.event == LedgerEvent::kRecorded;
    counters.frames_missing += entry.event == LedgerEvent::kMissing;
  }
  lock.unlock();
  for (const LedgerEntry& entry : sets)
    if (acknowledged && entry.event == LedgerEvent::kRecorded) acknowledged(entry.first_set);
  return true;
}

// What was written and never flushed is not in the take.
void Recorder::Shared::DropWritten() {
  const MutexLock lock(mutex);
  std::vector<LedgerEntry> lost;
  lost.swap(written);
  for (const LedgerEntry& entry : lost) {
    if (entry.event != LedgerEvent::kRecorded) continue;
    Drop(entry.first_set, entry.first_set, entry.device_time_ns,
         absl::StrCat("recording stopped: ", counters.stop_cause));
  }
}

TakeEnd Recorder::Shared::End(const absl::Status& status) const {
  TakeEnd end;
  end.outcome = status.ok() && counters.stop_cause.empty() ? TakeOutcome::kComplete : TakeOutcome::kStopped;
  end.cause = counters.stop_cause;
  end.ended_host_time_ns = HostTime_ns();
  end.sets_recorded = counters.sets_recorded;
  end.sets_dropped = counters.sets_dropped;
  end.frames_missing = counters.frames_missing;
  return end;
}

// What waits in the queue will be on the disk, too.
void Recorder::Shared::CheckDisk() {
  const absl::StatusOr<uint64_t> free_bytes = take->FreeBytes();
  if (!free_bytes.ok()) return;
  const MutexLock lock(mutex);
  const uint64_t kept_bytes = options.low_disk_bytes + counters.queued_bytes;
  counters.room_bytes = *free_bytes > kept_bytes ? *free_bytes - kept_bytes : 0;
  if (*free_bytes < options.low_disk_bytes) StopForRoom();
}

void Recorder::Shared::StopForRoom() {
  if (!counters.stop_cause.empty()) return;
  const absl::StatusOr<uint64_t> free_bytes = take->FreeBytes();
  counters.stop_cause = absl::StrCat("disk nearly full: ", free_bytes.value_or(0) >> 20,
                                     " MiB are free, the mark is ", options.low_disk_bytes >> 20, " MiB");
  events.push_back(
      {LedgerEvent::kNote, 0, 0, 0, HostTime_ns(), "", "recording stopped: " + counters.stop_cause});
}

void Recorder::Shared::FlusherLoop() {
  const auto interval = std::chrono::milliseconds(options.flush_interval_ms);
  MutexLock lock(mutex);
  while (!(stopping && writers_running == 0)) {
    changed.wait_for(lock, interval,
                     [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) { return stopping && writers_running == 0; });
    const bool has_failed = !failure.ok();
    lock.unlock();
    if (!has_failed) Flush();
    CheckDisk();
    lock.lock();
  }
  lock.unlock();
  Close();
  lock.lock();
  flusher_running = false;
  changed.notify_all();
}

// Once more after a failure: the disk may only have lacked the room that was reserved ahead of the streams.
void Recorder::Shared::Close() {
  absl::Status status;
  {
    const MutexLock lock(mutex);
    status = failure;
  }
  if (!status.ok()) take->Trim().IgnoreError();
  if (!Flush()) DropWritten();
  std::vector<LedgerEntry> entries;
  std::optional<uint64_t> last;
  TakeEnd end;
  {
    const MutexLock lock(mutex);
    status = failure;
    entries.swap(events);
    last = last_acknowledged;
    end = End(status);
  }
  status.Update(take->Close(last, entries, end));
  const MutexLock lock(mutex);
  close_status = status;
  if (!status.ok() && counters.stop_cause.empty()) counters.stop_cause = std::string(status.message());
  ++progress;
}

absl::StatusOr<std::unique_ptr<Recorder>> Recorder::Start(const std::string& folder,
                                                          const std::vector<std::string>& camera_ids,
                                                          const RecorderOptions& options,
                                                          Acknowledged acknowledged) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  TakeWriterOptions files = options.take;
  files.stream.keep_free_bytes = options.low_disk_bytes;
  files.stream.streams = camera_ids.size();
  WEFT_ASSIGN_OR_RETURN(auto take, TakeWriter::Create(folder, camera_ids, files));
  auto shared = std::make_shared<Shared>(std::move(take), options, std::move(acknowledged));
  for (int i = 0; i < options.writers; ++i)
    shared->threads.emplace_back([shared, i] { shared->WriterLoop(i); });
  shared->threads.emplace_back([shared] { shared->FlusherLoop(); });
  return std::unique_ptr<Recorder>(new Recorder(std::move(shared)));
}

Recorder::~Recorder() { Stop().IgnoreError(); }

bool Recorder::Offer(RawFrameSet set) {
  Shared& shared = *shared_;
  const std::string fault = FaultOfSet(set, shared.take->camera_ids(), shared.last_offered);
  const uint64_t bytes = set.bytes();
  const MutexLock lock(shared.mutex);
  ++shared.counters.sets_offered;
  std::string cause;
  if (!fault.empty()) {
    cause = absl::StrCat("refused: ", fault);
  } else if (!shared.counters.stop_cause.empty()) {
    cause = absl::StrCat("recording stopped: ", shared.counters.stop_cause);
  } else if (shared.counters.queued_bytes + bytes > shared.options.queue_bytes) {
    cause = absl::StrCat("disk too slow: the queue of ", shared.options.queue_bytes >> 20, " MiB is full");
  }
  if (cause.empty() && shared.options.low_disk_bytes > 0 && shared.counters.room_bytes &&
      *shared.counters.room_bytes < bytes) {
    shared.StopForRoom();
    cause = absl::StrCat("recording stopped: ", shared.counters.stop_cause);
  }
  if (fault.empty()) shared.last_offered = set.number;
  if (!cause.empty()) {
    shared.Drop(set.number, set.number, set.device_time_ns, cause);
    return false;
  }
  auto job = std::make_shared<Job>();
  job->set = std::move(set);
  job->bytes = bytes;
  job->writers_left = static_cast<int>(shared.queues.size());
  shared.counters.queued_bytes += bytes;
  if (shared.counters.room_bytes) *shared.counters.room_bytes -= std::min(*shared.counters.room_bytes, bytes);
  shared.counters.queued_bytes_peak =
      std::max(shared.counters.queued_bytes_peak, shared.counters.queued_bytes);
  for (auto& queue : shared.queues) queue.push_back(job);
  shared.changed.notify_all();
  return true;
}

bool Recorder::OfferAndWait(RawFrameSet set) {
  {
    const uint64_t bytes = set.bytes();
    MutexLock lock(shared_->mutex);
    shared_->changed.wait(lock, [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(shared_->mutex) {
      return !shared_->counters.stop_cause.empty() || shared_->counters.queued_bytes == 0 ||
             shared_->counters.queued_bytes + bytes <= shared_->options.queue_bytes;
    });
  }
  return Offer(std::move(set));
}

void Recorder::Note(const std::string& camera_id, const std::string& cause) {
  const MutexLock lock(shared_->mutex);
  shared_->events.push_back({LedgerEvent::kNote, 0, 0, 0, HostTime_ns(), camera_id, cause});
}

void Recorder::NoteDropped(uint64_t first_set, uint64_t last_set, int64_t device_time_ns,
                           const std::string& cause) {
  const MutexLock lock(shared_->mutex);
  shared_->counters.sets_offered += last_set - first_set + 1;
  shared_->Drop(first_set, last_set, device_time_ns, cause);
}

RecorderCounters Recorder::Counters() const {
  const MutexLock lock(shared_->mutex);
  return shared_->counters;
}

absl::Status Recorder::Stop() {
  Shared& shared = *shared_;
  MutexLock lock(shared.mutex);
  if (shared.stopped) return shared.close_status;
  shared.stopped = true;
  shared.stopping = true;
  shared.changed.notify_all();
  const auto patience = std::chrono::milliseconds(shared.options.stop_timeout_ms);
  for (uint64_t before = shared.progress;; before = shared.progress) {
    if (shared.changed.wait_for(lock, patience, [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(shared.mutex) {
          return !shared.flusher_running;
        }))
      break;
    if (shared.progress != before) continue;
    shared.close_status = absl::DeadlineExceededError(
        absl::StrCat("the disk has not answered for ", shared.options.stop_timeout_ms / 1000,
                     " s; the take was left as it is, run `weft take recover` when the disk is back"));
    for (std::thread& thread : shared.threads) thread.detach();
    return shared.close_status;
  }
  const absl::Status closed = shared.close_status;
  lock.unlock();
  for (std::thread& thread : shared.threads) thread.join();
  return closed;
}

}  // namespace weft
