// Vectors as wide as the registers, for the bodies of kernels. A file per instruction set defines
// WEFT_KERNEL_NAMESPACE before it includes them; no inline function of a library is used, so that no code for
// one processor gets into what others run.
#pragma once

#ifndef WEFT_KERNEL_NAMESPACE
#define WEFT_KERNEL_NAMESPACE baseline
#endif

#include <cstdint>
#include <cstring>

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 16;
#elif defined(__AVX2__)
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;
#endif

typedef float Lanes __attribute__((vector_size(4 * kLanes)));
typedef int32_t IntLanes __attribute__((vector_size(4 * kLanes)));
typedef float Lanes4 __attribute__((vector_size(16)));

template <typename Vector>
inline Vector LoadAs(const void* p) {
  Vector v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline Lanes Load(const float* p) { return LoadAs<Lanes>(p); }
inline void Store(Lanes v, float* p) { std::memcpy(p, &v, sizeof v); }

// Lanes 0, 2, 4 ... (odd = 0) or 1, 3, 5 ... (1) of two vectors behind each other.
inline IntLanes EveryOther(IntLanes low, IntLanes high, int odd) {
#if defined(__AVX512F__)
  return odd == 0
             ? __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30)
             : __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
#elif defined(__AVX2__)
  return odd == 0 ? __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14)
                  : __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15);
#else
  return odd == 0 ? __builtin_shufflevector(low, high, 0, 2, 4, 6)
                  : __builtin_shufflevector(low, high, 1, 3, 5, 7);
#endif
}

}  // namespace
}  // namespace weft::WEFT_KERNEL_NAMESPACE
