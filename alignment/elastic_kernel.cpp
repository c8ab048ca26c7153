#include "alignment/elastic_kernel.h"

#include "alignment/elastic_kernel_impl.h"

namespace weft {

const ElasticKernels& BestElasticKernels() {
  static const ElasticKernels& best = WEFT_FASTEST_BUILD(kElasticKernels);
  return best;
}

}  // namespace weft
