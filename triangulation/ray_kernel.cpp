#include "triangulation/ray_kernel.h"

#include "triangulation/ray_kernel_impl.h"

namespace weft {

const RayKernels& BestRayKernels() {
#ifdef __x86_64__
  static const RayKernels& best =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
              __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")
          ? avx512::kRayKernels
          : (__builtin_cpu_supports("avx2") ? avx2::kRayKernels : baseline::kRayKernels);
  return best;
#else
  return baseline::kRayKernels;
#endif
}

}  // namespace weft
