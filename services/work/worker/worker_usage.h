// What a worker has taken of its machine.
#pragma once

#include "weft/v1/task.pb.h"

namespace weft {

// Thread safety: none; to be asked by the process's main thread, whose waiting for a core it measures.
class UsageMeter {
 public:
  // Time counts from the start of the process, to 10 ms.
  UsageMeter();

  // What the kernel does not tell is 0.
  v1::WorkerUsage Now() const;

 private:
  double started_s_ = 0;  // CLOCK_BOOTTIME
};

}  // namespace weft
