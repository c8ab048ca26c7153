#include "pattern/cell_kernel.h"

#include "pattern/cell_kernel_impl.h"

namespace weft {

const CellKernels& BestCellKernels() {
#ifdef __x86_64__
  static const CellKernels& best =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
              __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")
          ? avx512::kCellKernels
          : (__builtin_cpu_supports("avx2") ? avx2::kCellKernels : baseline::kCellKernels);
  return best;
#else
  return baseline::kCellKernels;
#endif
}

}  // namespace weft
