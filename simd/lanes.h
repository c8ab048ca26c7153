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

// Lanes of the lower (upper = 0) or upper (1) halves of two vectors by turns: low 0, high 0, low 1, high 1
// ...
inline IntLanes ByTurns(IntLanes low, IntLanes high, int upper) {
#if defined(__AVX512F__)
  return upper == 0
             ? __builtin_shufflevector(low, high, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23)
             : __builtin_shufflevector(low, high, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15,
                                       31);
#elif defined(__AVX2__)
  return upper == 0 ? __builtin_shufflevector(low, high, 0, 8, 1, 9, 2, 10, 3, 11)
                    : __builtin_shufflevector(low, high, 4, 12, 5, 13, 6, 14, 7, 15);
#else
  return upper == 0 ? __builtin_shufflevector(low, high, 0, 4, 1, 5)
                    : __builtin_shufflevector(low, high, 2, 6, 3, 7);
#endif
}

// Turns rows into columns; kLanes rows.
inline void Transpose(IntLanes* rows) {
  for (int stride = 1; stride < kLanes; stride *= 2) {
    IntLanes mixed[kLanes];
    for (int i = 0; i < kLanes / 2; ++i) {
      mixed[2 * i] = ByTurns(rows[i], rows[i + kLanes / 2], 0);
      mixed[2 * i + 1] = ByTurns(rows[i], rows[i + kLanes / 2], 1);
    }
    for (int i = 0; i < kLanes; ++i) rows[i] = mixed[i];
  }
}

}  // namespace
}  // namespace weft::WEFT_KERNEL_NAMESPACE
