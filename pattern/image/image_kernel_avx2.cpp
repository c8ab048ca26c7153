#ifdef __x86_64__
#define WEFT_KERNEL_NAMESPACE avx2
#include "pattern/image/image_kernel_impl.h"
#endif
