#include "services/studio/video/at_once.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "base/mutex.h"

namespace weft {

absl::Status ForEachAtOnce(size_t count, size_t threads, const std::function<absl::Status(size_t)>& work) {
  std::atomic<size_t> next = 0;
  struct {
    Mutex mutex;
    absl::Status status ABSL_GUARDED_BY(mutex);
  } first;
  const auto run = [&] {
    for (size_t i = next++; i < count; i = next++) {
      const absl::Status status = work(i);
      const MutexLock lock(first.mutex);
      first.status.Update(status);
      if (!first.status.ok()) return;
    }
  };
  std::vector<std::thread> running;
  for (size_t i = 0; i < std::min(threads, count); ++i) running.emplace_back(run);
  for (std::thread& thread : running) thread.join();
  const MutexLock lock(first.mutex);
  return first.status;
}

}  // namespace weft
