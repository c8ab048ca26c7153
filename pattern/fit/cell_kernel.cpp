#include "pattern/fit/cell_kernel.h"

#include "pattern/fit/cell_kernel_impl.h"

namespace weft {

const CellKernels& BestCellKernels() {
  static const CellKernels& best = WEFT_FASTEST_BUILD(kCellKernels);
  return best;
}

}  // namespace weft
