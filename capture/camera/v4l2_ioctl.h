// The system call of V4L2.
#pragma once

#include <sys/ioctl.h>

namespace weft {

// 0, or -1 with errno; signals do not interrupt it.
int V4l2Ioctl(int fd, unsigned long request, void* argument);

}  // namespace weft
