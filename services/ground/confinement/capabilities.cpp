#include "services/ground/confinement/capabilities.h"

#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <initializer_list>

namespace weft {

bool KeepFileCapabilities() {
  __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  __user_cap_data_struct sets[2] = {};
  if (syscall(SYS_capget, &header, sets) != 0) return false;
  constexpr uint32_t kKept = 1u << CAP_DAC_OVERRIDE | 1u << CAP_DAC_READ_SEARCH;
  for (uint32_t* set : {&sets[0].effective, &sets[0].permitted, &sets[0].inheritable}) *set &= kKept;
  sets[1] = {};
  return syscall(SYS_capset, &header, sets) == 0;
}

}  // namespace weft
