// Vectors as wide as the registers, for the bodies of kernels. A file per instruction set defines
// WEFT_KERNEL_NAMESPACE before it includes them. They use no inline function of a library, so that the
// linker cannot merge code of different instruction sets.
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

inline Lanes Sqrt(Lanes v) {
  Lanes root;
  for (int lane = 0; lane < kLanes; ++lane) root[lane] = __builtin_sqrtf(v[lane]);
  return root;
}

// Vectors of four behind each other: kLanes / 4 of them.
inline Lanes Joined(const Lanes4* quarters) {
#if defined(__AVX512F__)
  typedef float Lanes8 __attribute__((vector_size(32)));
  const Lanes8 low = __builtin_shufflevector(quarters[0], quarters[1], 0, 1, 2, 3, 4, 5, 6, 7);
  const Lanes8 high = __builtin_shufflevector(quarters[2], quarters[3], 0, 1, 2, 3, 4, 5, 6, 7);
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
#elif defined(__AVX2__)
  return __builtin_shufflevector(quarters[0], quarters[1], 0, 1, 2, 3, 4, 5, 6, 7);
#else
  return quarters[0];
#endif
}

// The lower (upper = 0) or upper (1) two lanes of each four, by turns: a 0, b 0, a 1, b 1.
inline Lanes PairsByTurns(Lanes a, Lanes b, int upper) {
#if defined(__AVX512F__)
  return upper == 0
             ? __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29)
             : __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
#elif defined(__AVX2__)
  return upper == 0 ? __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13)
                    : __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
#else
  return upper == 0 ? __builtin_shufflevector(a, b, 0, 4, 1, 5) : __builtin_shufflevector(a, b, 2, 6, 3, 7);
#endif
}

// Turns rows into columns in each four lanes: 4 rows. Done twice it changes nothing.
inline void TransposeFours(Lanes* rows) {
  const Lanes a = PairsByTurns(rows[0], rows[2], 0), b = PairsByTurns(rows[1], rows[3], 0);
  const Lanes c = PairsByTurns(rows[0], rows[2], 1), d = PairsByTurns(rows[1], rows[3], 1);
  rows[0] = PairsByTurns(a, b, 0), rows[1] = PairsByTurns(a, b, 1);
  rows[2] = PairsByTurns(c, d, 0), rows[3] = PairsByTurns(c, d, 1);
}

// Records of four numbers, kLanes of them by their index, into a vector per number.
inline void GatherRecords(const float* records, const int32_t* index, Lanes* numbers) {
  for (int i = 0; i < 4; ++i) {
    Lanes4 quarters[kLanes / 4];
    for (int q = 0; q < kLanes / 4; ++q)
      quarters[q] = LoadAs<Lanes4>(records + 4 * static_cast<size_t>(index[4 * q + i]));
    numbers[i] = Joined(quarters);
  }
  TransposeFours(numbers);
}
// Those behind each other.
inline void LoadRecords(const float* records, Lanes* numbers) {
  for (int i = 0; i < 4; ++i) {
    Lanes4 quarters[kLanes / 4];
    for (int q = 0; q < kLanes / 4; ++q) quarters[q] = LoadAs<Lanes4>(records + 4 * (4 * q + i));
    numbers[i] = Joined(quarters);
  }
  TransposeFours(numbers);
}
inline void StoreRecords(Lanes a, Lanes b, Lanes c, Lanes d, float* records) {
  Lanes rows[4] = {a, b, c, d};
  TransposeFours(rows);
  float stored[4][kLanes];
  for (int i = 0; i < 4; ++i) Store(rows[i], stored[i]);
  for (int lane = 0; lane < kLanes; ++lane)
    std::memcpy(records + 4 * lane, stored[lane % 4] + lane / 4 * 4, 4 * sizeof(float));
}

}  // namespace
}  // namespace weft::WEFT_KERNEL_NAMESPACE
