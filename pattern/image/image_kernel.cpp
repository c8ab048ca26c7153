#include "pattern/image/image_kernel.h"

#include "pattern/image/image_kernel_impl.h"
#include "simd/allowed_build.h"

namespace weft {

const ImageKernels& BestImageKernels() {
  static const ImageKernels& best = WEFT_ALLOWED_BUILD(kImageKernels);
  return best;
}

}  // namespace weft
