#include "services/ground/process/thread_priority.h"

#include <sys/resource.h>
#include <unistd.h>

namespace weft {

void YieldToOthers(int niceness) { setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness); }

}  // namespace weft
