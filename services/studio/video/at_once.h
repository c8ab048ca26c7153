// Work on several videos at once.
#pragma once

#include <cstddef>
#include <functional>

#include "absl/status/status.h"

namespace weft {

// work(0) ... work(count - 1), up to `threads` at a time. The first error; what has not begun is left undone
// then. Threads instead of TBB's: a program that is started (VideoProgram) ends with the thread that started
// it.
absl::Status ForEachAtOnce(size_t count, size_t threads, const std::function<absl::Status(size_t)>& work);

}  // namespace weft
