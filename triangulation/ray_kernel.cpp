#include "triangulation/ray_kernel.h"

#include "triangulation/ray_kernel_impl.h"

namespace weft {

const RayKernels& BestRayKernels() {
  static const RayKernels& best = WEFT_FASTEST_BUILD(kRayKernels);
  return best;
}

}  // namespace weft
