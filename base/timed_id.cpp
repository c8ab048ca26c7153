#include "base/timed_id.h"

#include <random>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"

namespace weft {

std::string NewTimedId() {
  return absl::StrCat(UtcFileName(), "-", absl::Hex(std::random_device()(), absl::kZeroPad8));
}

}  // namespace weft
