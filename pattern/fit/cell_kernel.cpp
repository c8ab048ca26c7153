#include "pattern/fit/cell_kernel.h"

#include "pattern/fit/cell_kernel_impl.h"
#include "simd/allowed_build.h"

namespace weft {

const CellKernels& BestCellKernels() {
  static const CellKernels& best = WEFT_ALLOWED_BUILD(kCellKernels);
  return best;
}

}  // namespace weft
