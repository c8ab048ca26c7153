#include "triangulation/ray_kernel.h"

#include "triangulation/ray_kernel_impl.h"
#include "simd/allowed_build.h"

namespace weft {

const RayKernels& BestRayKernels() {
  static const RayKernels& best = WEFT_ALLOWED_BUILD(kRayKernels);
  return best;
}

}  // namespace weft
