#ifdef __x86_64__
#define WEFT_KERNEL_NAMESPACE avx512
#include "alignment/elastic_kernel_impl.h"
#endif
