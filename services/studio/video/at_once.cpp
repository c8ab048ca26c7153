#include "services/studio/video/at_once.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

namespace weft {

absl::Status ForEachAtOnce(size_t count, size_t threads, const std::function<absl::Status(size_t)>& work) {
  std::atomic<size_t> next = 0;
  std::mutex mutex;
  absl::Status first;
  const auto run = [&] {
    for (size_t i = next++; i < count; i = next++) {
      const absl::Status status = work(i);
      const std::lock_guard lock(mutex);
      first.Update(status);
      if (!first.ok()) return;
    }
  };
  std::vector<std::thread> running;
  for (size_t i = 0; i < std::min(threads, count); ++i) running.emplace_back(run);
  for (std::thread& thread : running) thread.join();
  return first;
}

}  // namespace weft
