#include "alignment/elastic_kernel.h"

#include "alignment/elastic_kernel_impl.h"
#include "simd/allowed_build.h"

namespace weft {

const ElasticKernels& BestElasticKernels() {
  static const ElasticKernels& best = WEFT_ALLOWED_BUILD(kElasticKernels);
  return best;
}

}  // namespace weft
