#include "pattern/image_kernel.h"

#include "pattern/image_kernel_impl.h"

namespace weft {

const ImageKernels& BestImageKernels() {
#ifdef __x86_64__
  static const ImageKernels& best =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
              __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")
          ? avx512::kImageKernels
          : (__builtin_cpu_supports("avx2") ? avx2::kImageKernels : baseline::kImageKernels);
  return best;
#else
  return baseline::kImageKernels;
#endif
}

}  // namespace weft
