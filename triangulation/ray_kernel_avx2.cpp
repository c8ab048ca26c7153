#ifdef __x86_64__
#define WEFT_KERNEL_NAMESPACE avx2
#include "triangulation/ray_kernel_impl.h"
#endif
