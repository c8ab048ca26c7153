// The build of a kernel that this process uses: the fastest one that the environment allows.
#pragma once

#include <cstdlib>
#include <string_view>

#include "simd/dispatch.h"

namespace weft {

// FastestBuild, unless the environment holds kernels back, for tests that compare builds:
// WEFT_INSTRUCTIONS=baseline or avx2.
template <typename Kernels>
const Kernels& AllowedBuild(const Kernels& avx512, const Kernels& avx2, const Kernels& baseline) {
  const char* allowed = std::getenv("WEFT_INSTRUCTIONS");
  const std::string_view most = allowed == nullptr ? "" : allowed;
  if (most == "baseline") return baseline;
  return FastestBuild(most == "avx2" ? avx2 : avx512, avx2, baseline);
}

}  // namespace weft

#ifdef __x86_64__
#define WEFT_ALLOWED_BUILD(kName) AllowedBuild(avx512::kName, avx2::kName, baseline::kName)
#else
#define WEFT_ALLOWED_BUILD(kName) (baseline::kName)
#endif
