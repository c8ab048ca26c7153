#include "services/server/daemon/calls/name_locks.h"

namespace weft {

std::shared_ptr<const void> NameLocks::Lock(const std::string& name) {
  if (name.empty()) return nullptr;
  MutexLock lock(mutex_);
  unlocked_.wait(lock, [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !locked_.contains(name); });
  locked_.insert(name);
  return {this, [this, name](const void*) { Unlock(name); }};
}

void NameLocks::Unlock(const std::string& name) {
  const MutexLock lock(mutex_);
  locked_.erase(name);
  unlocked_.notify_all();
}

}  // namespace weft
