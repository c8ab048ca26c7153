// Choice among the builds of a kernel for several instruction sets; see lanes.h for how they are made.
#pragma once

namespace weft {

// The fastest build that this processor runs; all give the same bytes.
template <typename Kernels>
const Kernels& FastestBuild([[maybe_unused]] const Kernels& avx512, [[maybe_unused]] const Kernels& avx2,
                            const Kernels& baseline) {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")) {
    return avx512;
  }
  if (__builtin_cpu_supports("avx2")) return avx2;
#endif
  return baseline;
}

}  // namespace weft

// WEFT_DECLARE_BUILDS(Kernels, kName): the constant kName of type Kernels in each build's namespace.
#ifdef __x86_64__
#define WEFT_DECLARE_BUILDS(Kernels, kName) \
  namespace baseline {                      \
  extern const Kernels kName;               \
  }                                         \
  namespace avx2 {                          \
  extern const Kernels kName;               \
  }                                         \
  namespace avx512 {                        \
  extern const Kernels kName;               \
  }
#else
#define WEFT_DECLARE_BUILDS(Kernels, kName) \
  namespace baseline {                      \
  extern const Kernels kName;               \
  }
#endif
