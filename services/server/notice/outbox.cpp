#include "services/server/notice/outbox.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/file_facts.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr char kNoticeEnding[] = ".json";

}  // namespace

Outbox::Outbox(OutboxOptions options, Deliver deliver)
    : options_(std::move(options)), deliver_(std::move(deliver)) {}

absl::StatusOr<std::unique_ptr<Outbox>> Outbox::Open(OutboxOptions options, Deliver deliver) {
  WEFT_RETURN_IF_ERROR(CreateFolders(options.folder));
  std::unique_ptr<Outbox> outbox(new Outbox(std::move(options), std::move(deliver)));
  outbox->Load();
  for (int i = 0; i < outbox->options_.at_once; ++i) {
    outbox->workers_.emplace_back([box = outbox.get()](const std::stop_token& stop) { box->Work(stop); });
  }
  return outbox;
}

Outbox::~Outbox() {
  for (std::jthread& worker : workers_) worker.request_stop();
  workers_.clear();
}

void Outbox::Load() {
  const MutexLock lock(mutex_);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(options_.folder, error)) {
    if (entry.path().extension() != kNoticeEnding) {
      RemoveFile(entry.path());  // half-written by a process that was killed
      continue;
    }
    struct stat info;
    if (stat(entry.path().c_str(), &info) != 0) continue;
    waiting_[entry.path().filename()] = {Clock::now(), UnixTime_ns(info.st_mtim)};
  }
  if (!waiting_.empty()) spdlog::info("{}: {} notices are delivered now", options_.folder, waiting_.size());
}

absl::Status Outbox::Put(const std::string& name, const std::string& body) {
  const std::string file = absl::StrCat(name, kNoticeEnding);
  {
    const MutexLock lock(mutex_);
    if (waiting_.contains(file)) return absl::OkStatus();
  }
  WEFT_RETURN_IF_ERROR(WriteFileAtomically(PathOf(file), body, 0600));
  const MutexLock lock(mutex_);
  waiting_.try_emplace(file, Notice{Clock::now(), HostTime_ns()});
  changed_.notify_all();
  return absl::OkStatus();
}

void Outbox::Work(const std::stop_token& stop) {
  MutexLock lock(mutex_);
  while (!stop.stop_requested()) {
    auto next = waiting_.end();
    for (auto it = waiting_.begin(); it != waiting_.end(); ++it) {
      if (!it->second.busy && (next == waiting_.end() || it->second.next < next->second.next)) next = it;
    }
    if (next == waiting_.end() || next->second.next > Clock::now()) {
      const auto until = next == waiting_.end() ? Clock::now() + std::chrono::hours(1) : next->second.next;
      const size_t known = waiting_.size();
      changed_.wait_until(lock, stop, until,
                          [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return waiting_.size() > known; });
      continue;
    }
    next->second.busy = true;
    const std::string name = next->first;
    lock.unlock();
    const absl::Status status = deliver_(PathOf(name), stop);
    lock.lock();
    if (!absl::IsCancelled(status)) Conclude(name, status);
  }
}

std::vector<Outbox::Waits> Outbox::Waiting() {
  const MutexLock lock(mutex_);
  std::vector<Waits> waits;
  for (const auto& [name, notice] : waiting_) waits.push_back({name, notice.since_unix_ns});
  return waits;
}

absl::Status Outbox::GiveUp(const std::string& name) {
  const MutexLock lock(mutex_);
  const auto found = waiting_.find(name);
  if (found == waiting_.end() || found->second.busy)
    return absl::FailedPreconditionError("it was delivered, or is being delivered");
  if (unlink(PathOf(name).c_str()) != 0 && errno != ENOENT) return WriteError(PathOf(name), errno);
  waiting_.erase(found);
  return absl::OkStatus();
}

void Outbox::Conclude(const std::string& name, const absl::Status& status) {
  Notice& waiting = waiting_[name];
  waiting.busy = false;
  const std::string why = EscapedText(std::string(status.message()));
  if (absl::IsUnavailable(status)) {
    waiting.pause = std::clamp(2 * waiting.pause, options_.first_pause, options_.longest_pause);
    waiting.next = Clock::now() + waiting.pause;
    spdlog::warn("notice {}: {}; again in {:.0f} s", name, why,
                 std::chrono::duration<double>(waiting.pause).count());
    return;
  }
  if (!status.ok()) spdlog::error("notice {} is given up: {}", name, why);
  std::error_code error;
  fs::remove(PathOf(name), error);
  if (error) {
    // It would be delivered again and again.
    spdlog::error("{} cannot be removed: {}; a restart delivers it again", PathOf(name), error.message());
  }
  waiting_.erase(name);
}

}  // namespace weft
