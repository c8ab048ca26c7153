#ifdef __x86_64__
#define WEFT_KERNEL_NAMESPACE avx512
#include "pattern/fit/cell_kernel_impl.h"
#endif
