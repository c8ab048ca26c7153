// Locks by name, for as many names as there are.
#pragma once

#include <condition_variable>
#include <memory>
#include <set>
#include <string>

#include "base/mutex.h"

namespace weft {

// Whoever locks a name that is locked waits; other names do not matter. Thread safety: any thread.
class NameLocks {
 public:
  // The name is locked until the answer ends, which must be before these locks do. The empty name is
  // nobody's: it is never locked.
  std::shared_ptr<const void> Lock(const std::string& name);

 private:
  void Unlock(const std::string& name);

  Mutex mutex_;
  std::condition_variable_any unlocked_;
  std::set<std::string> locked_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
