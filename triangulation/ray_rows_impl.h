// How rows of observations become rays, a part of the body of the ray kernels (ray_kernel_impl.h); see
// simd/lanes.h. A group of 16 nodes is taken in parts of kLanes.
#pragma once

#include <cstddef>

#include "simd/lanes.h"
#include "triangulation/ray_kernel.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

constexpr int kHalf = kLanes / 2;
typedef float HalfLanes __attribute__((vector_size(4 * kHalf)));
typedef double Doubles __attribute__((vector_size(8 * kHalf)));

typedef double FourDoubles __attribute__((vector_size(32)));
typedef uint64_t FourInts __attribute__((vector_size(32)));
typedef float FourPairs __attribute__((vector_size(32)));

inline Doubles LoadDoubles(const double* p) { return LoadAs<Doubles>(p); }
inline void StoreInts(IntLanes v, int32_t* p) { std::memcpy(p, &v, sizeof v); }

#if defined(__AVX512F__)
inline Lanes Join(HalfLanes a, HalfLanes b) {
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}
inline HalfLanes HalfOf(Lanes v, int half) {
  return half == 0 ? __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7)
                   : __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
}
#elif defined(__AVX2__)
inline Lanes Join(HalfLanes a, HalfLanes b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7); }
inline HalfLanes HalfOf(Lanes v, int half) {
  return half == 0 ? __builtin_shufflevector(v, v, 0, 1, 2, 3) : __builtin_shufflevector(v, v, 4, 5, 6, 7);
}
#else
inline Lanes Join(HalfLanes a, HalfLanes b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3); }
inline HalfLanes HalfOf(Lanes v, int half) {
  return half == 0 ? __builtin_shufflevector(v, v, 0, 1) : __builtin_shufflevector(v, v, 2, 3);
}
#endif

inline Lanes Short(const Doubles* halves) {
  return Join(__builtin_convertvector(halves[0], HalfLanes), __builtin_convertvector(halves[1], HalfLanes));
}
inline Lanes Max(Lanes a, float b) { return a > b ? a : Lanes{} + b; }

// Whether a comparison holds in any lane.
inline bool Any(IntLanes mask) {
  typedef int64_t Pairs __attribute__((vector_size(4 * kHalf)));
  const Lanes v = (Lanes)mask;
  const Pairs either = (Pairs)HalfOf(v, 0) | (Pairs)HalfOf(v, 1);
  int64_t any = 0;
  for (int k = 0; k < kHalf / 2; ++k) any |= either[k];
  return any != 0;
}

// The lens model (CameraModel): by how much it moves points of the plane z = 1, and the derivative of the
// moved point by the point.
struct Lens {
  Lanes shift[2];
  Lanes xx, xy, yy;
};

inline Lens Distort(const RayCamera& camera, Lanes x, Lanes y) {
  const float* d = camera.rough.distortion;
  const Lanes x2 = x * x, y2 = y * y, xy2 = 2.0f * x * y, r2 = x2 + y2;
  // The radial factor less 1: what is added to x loses no digits.
  Lanes growth = r2 * ((d[0] - d[5]) + r2 * ((d[1] - d[6]) + r2 * (d[4] - d[7])));
  Lanes slope = d[0] + r2 * (2.0f * d[1] + r2 * (3.0f * d[4]));
  if (camera.rational) {
    const Lanes inverse = 1.0f / (1.0f + r2 * (d[5] + r2 * (d[6] + r2 * d[7])));
    growth = growth * inverse;
    slope = (slope - (1.0f + growth) * (d[5] + r2 * (2.0f * d[6] + r2 * (3.0f * d[7])))) * inverse;
  }
  const Lanes along_x = 2.0f * d[3] * x, along_y = 2.0f * d[2] * y;
  Lens lens;
  lens.shift[0] = x * growth + d[2] * xy2 + d[3] * (r2 + 2.0f * x2);
  lens.shift[1] = y * growth + d[2] * (r2 + 2.0f * y2) + d[3] * xy2;
  lens.xx = 1.0f + growth + 2.0f * x2 * slope + along_y + 3.0f * along_x;
  lens.xy = xy2 * slope + 2.0f * d[2] * x + 2.0f * d[3] * y;
  lens.yy = 1.0f + growth + 2.0f * y2 * slope + 3.0f * along_y + along_x;
  return lens;
}

// Four observations at a time, as rows of four numbers that are turned into columns: x, y, the place on the
// board and, behind the kind, sigma.
inline bool Read(const RayCamera& camera, const Observation* seen, RayRow* row) {
  static_assert(offsetof(Observation, y_px) == 8 && offsetof(Observation, node) == 16 &&
                offsetof(BoardNode, col) == 4 && offsetof(BoardNode, kind) == 8 &&
                offsetof(Observation, sigma_px) == 28);
  constexpr uint64_t kKind = 0xff;  // of the first byte, padding follows
  const uint64_t first_place = LoadAs<uint64_t>(&seen->node.row),
                 kind = static_cast<uint64_t>(seen->node.kind);
  FourInts differs = {};
  FourDoubles infinite = {};
  Lanes4 least = seen->sigma_px - Lanes4{}, infinite_sigma = {};
  for (int lane = 0; lane < kNodeLanes; lane += 4) {
    FourDoubles rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = LoadAs<FourDoubles>(&seen[lane + i]);
    const FourDoubles x_place_0 = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6);
    const FourDoubles x_place_2 = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6);
    const FourDoubles y_kind_0 = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7);
    const FourDoubles y_kind_2 = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
    const FourDoubles pixel_px[2] = {__builtin_shufflevector(x_place_0, x_place_2, 0, 1, 4, 5),
                                     __builtin_shufflevector(y_kind_0, y_kind_2, 0, 1, 4, 5)};
    const FourInts place = (FourInts)__builtin_shufflevector(x_place_0, x_place_2, 2, 3, 6, 7);
    const FourInts kind_sigma = (FourInts)__builtin_shufflevector(y_kind_0, y_kind_2, 2, 3, 6, 7);
    const FourPairs pairs = (FourPairs)kind_sigma;
    const Lanes4 sigma_px = __builtin_shufflevector(pairs, pairs, 1, 3, 5, 7);
    const uint64_t lane_place = first_place + (static_cast<uint64_t>(lane) << 32);
    differs |= place ^ (lane_place + FourInts{0, 1ull << 32, 2ull << 32, 3ull << 32});
    differs |= (kind_sigma & kKind) ^ kind;
    for (int k = 0; k < 2; ++k) {
      infinite += pixel_px[k] - pixel_px[k];  // NaN, else 0
      const FourDoubles exact = (pixel_px[k] - camera.center_px[k]) * camera.inverse_focal_px[k];
      const Lanes4 pixel = __builtin_convertvector(exact, Lanes4);
      const Lanes4 rest =
          __builtin_convertvector(exact - __builtin_convertvector(pixel, FourDoubles), Lanes4);
      std::memcpy(row->pixel[k] + lane, &pixel, sizeof pixel);
      std::memcpy(row->to_ray[k] + lane, &rest, sizeof rest);
    }
    infinite_sigma += sigma_px - sigma_px;
    least = least < sigma_px ? least : sigma_px;
    std::memcpy(row->sigma_px + lane, &sigma_px, sizeof sigma_px);
  }
  bool valid = true;
  for (int i = 0; i < 4; ++i)
    valid &= differs[i] == 0 && infinite[i] == 0 && infinite_sigma[i] == 0 && least[i] > 0;
  return valid;
}

// Newton's method. A lane that is done stays as it is: the bytes must not depend on the others.
inline void UndistortRow(const RayCamera& camera, int first, RayRow* row) {
  constexpr int kMaxIterations = 10;
  constexpr float kTolerance2 = 1e-6f;  // squared step, about what remains after it
  const Lanes pixel[2] = {Load(row->pixel[0] + first), Load(row->pixel[1] + first)};
  const Lanes rest[2] = {Load(row->to_ray[0] + first), Load(row->to_ray[1] + first)};
  Lanes x = rest[0], y = rest[1], xx = {}, xy = {}, yy = {};
  IntLanes moving = Load(row->sigma_px + first) > 0.0f;
  const IntLanes wanted = moving;
  for (int i = 0; i < kMaxIterations && Any(moving); ++i) {
    const Lens lens = Distort(camera, pixel[0] + x, pixel[1] + y);
    const Lanes off_x = x - rest[0] + lens.shift[0], off_y = y - rest[1] + lens.shift[1];
    const Lanes scale = 1.0f / (lens.xx * lens.yy - lens.xy * lens.xy);
    const Lanes step_x = (lens.yy * off_x - lens.xy * off_y) * scale;
    const Lanes step_y = (lens.xx * off_y - lens.xy * off_x) * scale;
    x = moving ? x - step_x : x;
    y = moving ? y - step_y : y;
    xx = moving ? lens.xx : xx;
    xy = moving ? lens.xy : xy;
    yy = moving ? lens.yy : yy;
    moving &= (step_x * step_x + step_y * step_y) > kTolerance2;
  }
  const Lanes ray[2] = {pixel[0] + x, pixel[1] + y};
  const IntLanes found = wanted & ~moving & ((ray[0] * ray[0] + ray[1] * ray[1]) < camera.safe_square);
  const Lanes none = Lanes{} + __builtin_nanf("");
  Store(found ? x : none, row->to_ray[0] + first);
  Store(found ? y : none, row->to_ray[1] + first);
  // A lens that is no number, of a pixel without a ray, would spoil the sums of its node.
  Store(found ? xx : Lanes{}, row->lens[0] + first);
  Store(found ? xy : Lanes{}, row->lens[1] + first);
  Store(found ? yy : Lanes{}, row->lens[2] + first);
}

inline void Undistort(const RayCamera* cameras, int count, RayRow* rows) {
  for (int i = 0; i < count; ++i)
    for (int first = 0; first < kNodeLanes; first += kLanes)
      UndistortRow(cameras[rows[i].camera], first, &rows[i]);
}

}  // namespace
}  // namespace weft::WEFT_KERNEL_NAMESPACE
