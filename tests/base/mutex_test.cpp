#include "base/mutex.h"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <stop_token>
#include <thread>
#include <vector>

namespace weft {
namespace {

// Whether another thread could take it.
template <typename Kind>
bool IsFree(Kind& mutex) {
  bool free = false;
  std::jthread([&mutex, &free] {
    if (!mutex.try_lock()) return;
    free = true;
    mutex.unlock();
  }).join();
  return free;
}

class Counter {
 public:
  void Add() {
    const MutexLock lock(mutex_);
    ++count_;
    changed_.notify_all();
  }

  // False: it was told to stop.
  bool WaitFor(int count, const std::stop_token& stop) {
    MutexLock lock(mutex_);
    return changed_.wait(lock, stop,
                         [this, count]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return count_ >= count; });
  }

  bool WaitFor(int count, std::chrono::milliseconds patience) {
    MutexLock lock(mutex_);
    return changed_.wait_for(
        lock, patience, [this, count]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return count_ >= count; });
  }

 private:
  Mutex mutex_;
  std::condition_variable_any changed_;
  int count_ ABSL_GUARDED_BY(mutex_) = 0;
};

TEST(MutexLock, HoldsTheMutexToTheEndOfItsScope) {
  Mutex mutex;
  {
    const MutexLock lock(mutex);
    EXPECT_FALSE(IsFree(mutex));
  }
  EXPECT_TRUE(IsFree(mutex));
}

TEST(MutexLock, LetsGoInBetween) {
  Mutex mutex;
  {
    MutexLock lock(mutex);
    lock.unlock();
    EXPECT_TRUE(IsFree(mutex));
    lock.lock();
    EXPECT_FALSE(IsFree(mutex));
    lock.unlock();
  }
  EXPECT_TRUE(IsFree(mutex)) << "it was unlocked a second time";
}

TEST(MutexLock, TakesOverWhatIsLocked) {
  TimedMutex mutex;
  if (!mutex.try_lock_for(std::chrono::milliseconds(1))) FAIL() << "nobody has it";
  {
    const MutexLock lock(mutex, std::adopt_lock);
    EXPECT_FALSE(IsFree(mutex));
  }
  EXPECT_TRUE(IsFree(mutex));
}

TEST(RecursiveMutex, IsTakenTwiceByOneThread) {
  RecursiveMutex mutex;
  const MutexLock lock(mutex);
  const auto again = [&mutex] { const MutexLock inner(mutex); };
  again();
  EXPECT_FALSE(IsFree(mutex)) << "the inner lock ended the outer one";
}

TEST(Mutex, CountsOfManyThreadsAreWaitedFor) {
  Counter counter;
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&counter] {
      for (int j = 0; j < 1000; ++j) counter.Add();
    });
  }
  EXPECT_TRUE(counter.WaitFor(4000, std::stop_token()));
  EXPECT_FALSE(counter.WaitFor(4001, std::chrono::milliseconds(1)));
}

TEST(Mutex, AWaitEndsByAStopToken) {
  Counter counter;
  std::stop_source source;
  std::jthread stopper([&source] { source.request_stop(); });
  EXPECT_FALSE(counter.WaitFor(1, source.get_token()));
}

}  // namespace
}  // namespace weft
