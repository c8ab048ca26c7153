// The catalogue of jobs, written behind: who changes a job never waits for the disk.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/server/catalogue/catalogue.h"

namespace weft {

// States of jobs that run are put, and reach the disk soon: many changes of a job are one transaction. What
// the disk does not take is tried again until it does. A thread writes.
// Thread safety: any thread may call any function.
class JobStore {
 public:
  explicit JobStore(std::unique_ptr<Catalogue> catalogue);
  ~JobStore() { Stop(); }
  // Writes what is left, where the disk takes it. What is put from now on is not written.
  void Stop();

  // What is on the disk. What is changed there is of no job that was put and not flushed.
  Catalogue& disk() { return *catalogue_; }

  // Written soon. `frames`: those that changed, by position; further ones are added.
  void Put(const v1::Job& job, const std::map<size_t, v1::FrameInfo>& frames);
  // The last state of a job with all of its frames. `written` is called once it is on the disk, `refused`
  // each time that it cannot be written, with why; both in the thread of the store.
  void PutLast(const v1::Job& job, const std::vector<v1::FrameInfo>& frames, std::function<void()> written,
               std::function<void(const std::string& why)> refused);
  // Waits until what was put of this job is written, or cannot be written for now. Not for the functions that
  // are called by the store's thread. DeadlineExceeded, with why.
  absl::Status Flush(const std::string& job_id, std::chrono::milliseconds patience);

  // Why states cannot be written; empty: they can.
  std::string Trouble();
  // Of the catalogue's restoration and its writing.
  std::vector<std::string> Warnings();

 private:
  using Time = std::chrono::steady_clock::time_point;
  // What of a job is not on the disk.
  struct Pending {
    v1::Job job;
    std::map<size_t, v1::FrameInfo> frames;
    bool is_changed = false, is_writing = false;
    bool was_refused = false;       // at the last try
    std::function<void()> written;  // of its last state
    std::function<void(const std::string& why)> refused;
  };

  void Work();
  bool IsAnyChanged() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool WriteNext(MutexLock<Mutex>& lock) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) ABSL_NO_THREAD_SAFETY_ANALYSIS;
  absl::Status Write(const Pending& pending);
  void NoteWritten(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::unique_ptr<Catalogue> catalogue_;

  Mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Pending> pending_ ABSL_GUARDED_BY(mutex_);  // by job
  std::string last_tried_ ABSL_GUARDED_BY(mutex_);                  // the jobs behind it are next
  std::optional<Time> write_again_ ABSL_GUARDED_BY(mutex_);
  std::string trouble_ ABSL_GUARDED_BY(mutex_);
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  bool has_stopped_ ABSL_GUARDED_BY(mutex_) = false;  // nothing is written any more
  std::thread thread_;
};

}  // namespace weft
