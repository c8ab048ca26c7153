#include "triangulation/ray_kernel.h"

#include "simd/allowed_build.h"
#include "triangulation/ray_kernel_impl.h"

namespace weft {

const RayKernels& BestRayKernels() {
  static const RayKernels& best = WEFT_ALLOWED_BUILD(kRayKernels);
  return best;
}

}  // namespace weft
