// Mutexes of which clang checks what they guard.
#pragma once

#include <chrono>
#include <mutex>

#include "absl/base/thread_annotations.h"

namespace weft {

// A mutex of the standard library with the annotations of clang's thread-safety analysis, which libstdc++
// leaves out. What it guards is ABSL_GUARDED_BY it; a function that needs it has
// ABSL_EXCLUSIVE_LOCKS_REQUIRED. Not absl::Mutex, since nothing of that waits for a std::stop_token and the
// thread sanitizer does not see into Debian's Abseil. Conditions are std::condition_variable_any, which waits
// with a MutexLock. A lambda that they ask is annotated, too:
//   changed_.wait(lock, stop, [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !waiting_.empty(); });
template <typename Standard>
class ABSL_LOCKABLE AnnotatedMutex {
 public:
  void lock() ABSL_EXCLUSIVE_LOCK_FUNCTION() { mutex_.lock(); }
  void unlock() ABSL_UNLOCK_FUNCTION() { mutex_.unlock(); }
  // Tells the analysis what it cannot see: this thread holds it, by another name.
  void AssertHeld() const ABSL_ASSERT_EXCLUSIVE_LOCK() {}
  [[nodiscard]] bool try_lock() ABSL_EXCLUSIVE_TRYLOCK_FUNCTION(true) { return mutex_.try_lock(); }
  [[nodiscard]] bool try_lock_for(std::chrono::milliseconds patience) ABSL_EXCLUSIVE_TRYLOCK_FUNCTION(true) {
    return mutex_.try_lock_for(patience);
  }

 private:
  Standard mutex_;
};

using Mutex = AnnotatedMutex<std::mutex>;
using RecursiveMutex = AnnotatedMutex<std::recursive_mutex>;
using TimedMutex = AnnotatedMutex<std::timed_mutex>;

// Holds a mutex to the end of its scope, but for what lies between unlock and lock.
template <typename Kind>
class ABSL_SCOPED_LOCKABLE MutexLock {
 public:
  explicit MutexLock(Kind& mutex) ABSL_EXCLUSIVE_LOCK_FUNCTION(mutex) : lock_(mutex) {}
  // One that this thread has locked already.
  MutexLock(Kind& mutex, std::adopt_lock_t adopt) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex)
      : lock_(mutex, adopt) {}
  ~MutexLock() ABSL_UNLOCK_FUNCTION() = default;
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

  void lock() ABSL_EXCLUSIVE_LOCK_FUNCTION() { lock_.lock(); }
  void unlock() ABSL_UNLOCK_FUNCTION() { lock_.unlock(); }

 private:
  std::unique_lock<Kind> lock_;
};

}  // namespace weft
