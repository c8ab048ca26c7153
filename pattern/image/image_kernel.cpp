#include "pattern/image/image_kernel.h"

#include "pattern/image/image_kernel_impl.h"

namespace weft {

const ImageKernels& BestImageKernels() {
  static const ImageKernels& best = WEFT_FASTEST_BUILD(kImageKernels);
  return best;
}

}  // namespace weft
