// Landlock: which files a thread, and what it starts, may use from now on.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"

namespace weft {

// Version of the kernel's interface; 0: it has none, or it is switched off.
int LandlockVersion();

// Rules that are collected, then enforced. Files without a rule are denied with EACCES; open descriptors stay
// as they are. Debian 12 has no library for it, so these are the system calls.
class LandlockRules {
 public:
  struct Scope {
    bool may_use_network = false;  // TCP; needs version 4 to be denied
    bool may_signal = false;       // processes that are not confined alike; needs version 6 to be denied
  };
  // Unavailable: LandlockVersion() is 0, or no descriptor is left.
  static absl::StatusOr<LandlockRules> Create(const Scope& scope);

  enum class Access { kRead, kReadAndRun, kUseDevices, kReadAndWrite };
  // For a file, or a folder and what is below it. `fd` may be of O_PATH.
  absl::Status Allow(int fd, Access access);
  // For the calling thread and all that it starts from now on; they gain no privileges by programs that they
  // run either.
  absl::Status Enforce() const;

 private:
  LandlockRules(UniqueFd rules, uint64_t handled) : rules_(std::move(rules)), handled_(handled) {}

  UniqueFd rules_;
  uint64_t handled_;  // accesses that are denied without a rule
};

}  // namespace weft
