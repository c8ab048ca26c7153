#include "services/server/daemon/work/job_store.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr std::chrono::seconds kWriteAgainAfter{1};

}  // namespace

JobStore::JobStore(std::unique_ptr<Catalogue> catalogue)
    : catalogue_(std::move(catalogue)), thread_(&JobStore::Work, this) {}

void JobStore::Stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void JobStore::Put(const v1::Job& job, const std::map<size_t, v1::FrameInfo>& frames) {
  const MutexLock lock(mutex_);
  Pending& pending = pending_[job.id()];
  pending.job = job;
  pending.is_changed = true;
  for (const auto& [position, info] : frames) pending.frames.insert_or_assign(position, info);
  changed_.notify_all();
}

void JobStore::PutLast(const v1::Job& job, const std::vector<v1::FrameInfo>& frames,
                       std::function<void()> written, std::function<void(const std::string&)> refused) {
  const MutexLock lock(mutex_);
  Pending& pending = pending_[job.id()];
  pending.job = job;
  pending.is_changed = true;
  for (size_t position = 0; position < frames.size(); ++position)
    pending.frames.insert_or_assign(position, frames[position]);
  pending.written = std::move(written);
  pending.refused = std::move(refused);
  changed_.notify_all();
}

absl::Status JobStore::Flush(const std::string& job_id, std::chrono::milliseconds patience) {
  MutexLock lock(mutex_);
  bool is_written = false;
  changed_.wait_for(lock, patience, [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const auto found = pending_.find(job_id);
    is_written = found == pending_.end() || (!found->second.is_changed && !found->second.is_writing);
    return is_written || found->second.was_refused || has_stopped_;
  });
  if (is_written) return absl::OkStatus();
  return absl::DeadlineExceededError(absl::StrCat("job ", job_id, ": its state cannot be written down yet",
                                                  trouble_.empty() ? "" : ": ", trouble_));
}

std::string JobStore::Trouble() {
  const MutexLock lock(mutex_);
  return trouble_;
}

std::vector<std::string> JobStore::Warnings() {
  const MutexLock lock(mutex_);
  std::vector<std::string> warnings = catalogue_->warnings();
  if (!trouble_.empty()) warnings.push_back(trouble_);
  return warnings;
}

absl::Status JobStore::Write(const Pending& pending) {
  if (pending.written) {
    std::vector<v1::FrameInfo> all;  // PutLast had them
    for (const auto& [position, info] : pending.frames) all.push_back(info);
    return catalogue_->UpdateAll(pending.job, all);
  }
  const absl::Status status = catalogue_->Update(pending.job, pending.frames);
  // Forgotten meanwhile. Where its row was damaged while it ran, its record and its end have the job.
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

void JobStore::NoteWritten(const absl::Status& status) {
  if (status.ok()) {
    if (!trouble_.empty()) spdlog::info("the catalogue is written again");
    trouble_.clear();
    return;
  }
  if (trouble_.empty()) spdlog::error("{}; it is tried again until it works", std::string(status.message()));
  trouble_ = std::string(status.message());
  write_again_ = std::chrono::steady_clock::now() + kWriteAgainAfter;
}

bool JobStore::IsAnyChanged() const {
  return std::any_of(pending_.begin(), pending_.end(),
                     [](const auto& entry) { return entry.second.is_changed; });
}

// Lets go of the lock while the disk writes. False: nothing can be written now.
bool JobStore::WriteNext(MutexLock<Mutex>& lock) {
  if (!IsAnyChanged()) return false;
  // One that the disk refuses keeps no other waiting.
  auto next = pending_.upper_bound(last_tried_);
  while (next == pending_.end() || !next->second.is_changed)
    next = next == pending_.end() ? pending_.begin() : std::next(next);
  const std::string id = last_tried_ = next->first;
  const Pending writing = std::exchange(next->second, {.job = next->second.job, .is_writing = true});
  lock.unlock();
  const absl::Status status = Write(writing);
  if (status.ok() && writing.written) writing.written();
  if (!status.ok() && writing.refused) writing.refused(std::string(status.message()));
  lock.lock();
  NoteWritten(status);
  Pending& now = pending_[id];
  now.is_writing = false;
  now.was_refused = !status.ok();
  if (!status.ok()) {
    now.is_changed = true;
    // Not over newer ones.
    now.frames.insert(writing.frames.begin(), writing.frames.end());
    if (!now.written) now.written = writing.written, now.refused = writing.refused;
  } else if (writing.written && !now.is_changed) {
    pending_.erase(id);
  }
  changed_.notify_all();
  return status.ok();
}

void JobStore::Work() {
  MutexLock lock(mutex_);
  for (;;) {
    if (write_again_ && *write_again_ <= std::chrono::steady_clock::now()) write_again_.reset();
    if (!write_again_ && WriteNext(lock)) continue;
    if (stopping_) break;
    const auto has_news = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
      return stopping_ || (!write_again_ && IsAnyChanged());
    };
    if (write_again_) {
      changed_.wait_until(lock, *write_again_, has_news);
    } else {
      changed_.wait(lock, has_news);
    }
  }
  // What the disk refused a moment ago it may take now.
  write_again_.reset();
  while (WriteNext(lock)) {
  }
  has_stopped_ = true;
  changed_.notify_all();
}

}  // namespace weft
