// Body of the image kernels; see simd/lanes.h.
#include "pattern/image/image_kernel.h"
#include "simd/lanes.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

// Twice as many shorts as lanes, and half of them.
constexpr int kShorts = 2 * kLanes;
typedef uint16_t Shorts __attribute__((vector_size(4 * kLanes)));
typedef uint16_t HalfOfShorts __attribute__((vector_size(2 * kLanes)));
typedef uint8_t BytesOfShorts __attribute__((vector_size(kShorts)));
typedef int8_t BytesOfLanes __attribute__((vector_size(kLanes)));

// Whole blocks of lanes, and what is left of a row after them.
template <int lanes>
struct Whole {
  static constexpr int n = lanes;
};
struct Rest {
  int n;
};

template <int lanes, typename Body>
inline void ForBlocks(int width, Body body) {
  int x = 0;
  for (; x + lanes <= width; x += lanes) body(x, Whole<lanes>());
  if (x < width) body(x, Rest{width - x});
}

template <typename Vector, typename Extent>
inline Vector LoadSome(const void* p, Extent extent, size_t bytes_per_lane) {
  Vector v = {};
  std::memcpy(&v, p, static_cast<size_t>(extent.n) * bytes_per_lane);
  return v;
}
template <typename Extent>
inline Lanes LoadFloats(const float* p, Extent extent) {
  return LoadSome<Lanes>(p, extent, sizeof(float));
}
template <typename Extent>
inline void StoreFloats(Lanes v, float* p, Extent extent) {
  std::memcpy(p, &v, static_cast<size_t>(extent.n) * sizeof(float));
}

inline Lanes Min(Lanes a, Lanes b) { return a < b ? a : b; }

void DemosaicRow(const BayerRow& row, int width, uint8_t* __restrict__ out) {
  const uint8_t *above = row.above, *here = row.here, *below = row.below;
  // Blocks begin at odd pixels.
  const Shorts odd_lanes = (Shorts)(IntLanes{} + static_cast<int32_t>(0xffff0000));
  const Shorts green_here = row.first_green ? odd_lanes : ~odd_lanes;
  ForBlocks<kShorts>(width - 2, [&](int k, auto extent) {
    const int x = k + 1;
    const auto at = [&](const uint8_t* line, int dx) {
      return __builtin_convertvector(LoadSome<BytesOfShorts>(line + x + dx, extent, 1), Shorts);
    };
    const Shorts pixel = at(here, 0);
    const Shorts across = at(here, -1) + at(here, 1), down = at(above, 0) + at(below, 0);
    const Shorts diagonal = at(above, -1) + at(above, 1) + at(below, -1) + at(below, 1);
    const Shorts own = (green_here & ((across + 1) >> 1)) | (~green_here & pixel);
    const Shorts green = (green_here & pixel) | (~green_here & ((across + down + 2) >> 2));
    const Shorts other = (green_here & ((down + 1) >> 1)) | (~green_here & ((diagonal + 2) >> 2));
    const Shorts red_green = (row.with_red ? own : other) | (green << 8), blue = row.with_red ? other : own;
    HalfOfShorts low[2], high[2];
    std::memcpy(low, &red_green, sizeof low);
    std::memcpy(high, &blue, sizeof high);
    IntLanes pixels[2];
    for (int half = 0; half < 2; ++half) {
      pixels[half] = __builtin_convertvector(low[half], IntLanes) |
                     (__builtin_convertvector(high[half], IntLanes) << 16);
    }
    std::memcpy(out + 4 * x, pixels, static_cast<size_t>(extent.n) * 4);
  });
  std::memcpy(out, out + 4, 4);
  std::memcpy(out + 4 * (width - 1), out + 4 * (width - 2), 4);
}

void WidenRow(const uint8_t* __restrict__ rgb, int width, uint8_t* __restrict__ out) {
  for (int x = 0; x + 1 < width; ++x) {
    uint32_t pixel;
    std::memcpy(&pixel, rgb + 3 * x, 4);
    pixel &= 0xffffff;
    std::memcpy(out + 4 * x, &pixel, 4);
  }
  std::memcpy(out + 4 * (width - 1), rgb + 3 * (width - 1), 3);
  out[4 * width - 1] = 0;
}

void HalveRows(const uint8_t* upper, const uint8_t* lower, int half_width, uint8_t* __restrict__ out) {
  constexpr int kMask = 0xff00ff;  // two of the four channels
  constexpr int kHalf = kLanes / 2;
  ForBlocks<kLanes>(half_width, [&](int x, auto extent) {
    const int first = extent.n < kHalf ? extent.n : kHalf, rest = extent.n - first;
    IntLanes even = {}, odd = {};
    const uint8_t* const rows[] = {upper, lower};
    for (const uint8_t* row : rows) {
      const uint8_t* p = row + 8 * x;
      IntLanes low = {}, high = {};
      std::memcpy(&low, p, static_cast<size_t>(first) * 8);
      std::memcpy(&high, p + 8 * kHalf, static_cast<size_t>(rest) * 8);
      const IntLanes left = EveryOther(low, high, 0), right = EveryOther(low, high, 1);
      even += (left & kMask) + (right & kMask);
      odd += ((left >> 8) & kMask) + ((right >> 8) & kMask);
    }
    const IntLanes mean = (((even + 0x20002) >> 2) & kMask) | ((((odd + 0x20002) >> 2) & kMask) << 8);
    std::memcpy(out + 4 * x, &mean, static_cast<size_t>(extent.n) * 4);
  });
}

// Natural logarithm for 1 to 2^20, to within 2e-6.
inline Lanes Log(Lanes value) {
  constexpr float kLn2 = 0.693147181f;
  const IntLanes bits = (IntLanes)value;
  const Lanes exponent = __builtin_convertvector((bits >> 23) - 127, Lanes);
  const Lanes t = (Lanes)((bits & 0x7fffff) | 0x3f800000) - 1.0f;
  Lanes p = -0.0174140781f * t + 0.0826912373f;
  constexpr float kRest[] = {-0.190354332f, 0.315747321f, -0.497373223f, 0.99984771f, 1.47206504e-6f};
  for (const float coefficient : kRest) p = p * t + coefficient;
  return exponent * kLn2 + p;
}

void BrightnessRow(const uint8_t* rgbx, int width, float* __restrict__ out) {
  constexpr int kOffset = 10;
  ForBlocks<kLanes>(width, [&](int x, auto extent) {
    const IntLanes pixel = LoadSome<IntLanes>(rgbx + 4 * x, extent, 4);
    const IntLanes red = pixel & 255, green = (pixel >> 8) & 255, blue = (pixel >> 16) & 255;
    IntLanes most = red > green ? red : green;
    most = most > blue ? most : blue;
    StoreFloats(Log(__builtin_convertvector(most + kOffset, Lanes)), out + x, extent);
  });
}

void SpotRow(const float* const* rows, const SpotTaps& taps, int width, float* __restrict__ scratch,
             float* __restrict__ out) {
  const float *narrow = taps.narrow, *wide = taps.wide;
  const int narrow_reach = taps.narrow_reach, reach = taps.reach;
  float *near = scratch + reach, *far = near + width + 2 * reach;
  ForBlocks<kLanes>(width, [&](int x, auto extent) {
    const Lanes here = LoadFloats(rows[reach] + x, extent);
    Lanes n = narrow[0] * here, w = wide[0] * here;
    const auto both = [&](int k) {
      return LoadFloats(rows[reach - k] + x, extent) + LoadFloats(rows[reach + k] + x, extent);
    };
    for (int k = 1; k <= narrow_reach; ++k) {
      const Lanes pair = both(k);
      n += narrow[k] * pair;
      w += wide[k] * pair;
    }
    for (int k = narrow_reach + 1; k <= reach; ++k) w += wide[k] * both(k);
    StoreFloats(n, near + x, extent);
    StoreFloats(w, far + x, extent);
  });
  float* const both_rows[] = {near, far};
  for (float* mid : both_rows) {
    for (int k = 1; k <= reach; ++k) {
      mid[-k] = mid[0];
      mid[width - 1 + k] = mid[width - 1];
    }
  }
  ForBlocks<kLanes>(width, [&](int x, auto extent) {
    Lanes n = narrow[0] * LoadFloats(near + x, extent), w = wide[0] * LoadFloats(far + x, extent);
    const auto both = [&](const float* mid, int k) {
      return LoadFloats(mid + x - k, extent) + LoadFloats(mid + x + k, extent);
    };
    for (int k = 1; k <= narrow_reach; ++k) n += narrow[k] * both(near, k);
    for (int k = 1; k <= reach; ++k) w += wide[k] * both(far, k);
    StoreFloats(n - w, out + x, extent);
  });
}

inline bool IsAny(BytesOfLanes bytes) {
  uint32_t fours[kLanes / 4], any = 0;
  std::memcpy(fours, &bytes, sizeof fours);
  for (const uint32_t four : fours) any |= four;
  return any != 0;
}

void PeakRow(const float* const* rows, float contrast, int width, float* __restrict__ scratch,
             uint8_t* __restrict__ peaks) {
  constexpr int kReach = 3;
  float* least = scratch + kReach;
  ForBlocks<kLanes>(width, [&](int x, auto extent) {
    Lanes low = LoadFloats(rows[0] + x, extent);
    for (int k = 1; k <= 2 * kReach; ++k) low = Min(low, LoadFloats(rows[k] + x, extent));
    StoreFloats(low, least + x, extent);
  });
  for (int k = 1; k <= kReach; ++k) {
    least[-k] = least[0];
    least[width - 1 + k] = least[width - 1];
  }
  const float *above = rows[kReach - 1], *here = rows[kReach], *below = rows[kReach + 1];
  ForBlocks<kLanes>(width - 2, [&](int k, auto extent) {
    const int x = k + 1;
    const auto at = [&](const float* row, int dx) { return LoadFloats(row + x + dx, extent); };
    const Lanes v = at(here, 0);
    Lanes low = at(least, 0);
    for (int d = 1; d <= kReach; ++d) low = Min(low, Min(at(least, -d), at(least, d)));
    const IntLanes clear = (v > 0.0f) & (v - low >= contrast);
    BytesOfLanes peak = __builtin_convertvector(clear & 1, BytesOfLanes);
    if (IsAny(peak)) {
      const IntLanes row = clear & (v > at(here, 1)) & (v >= at(here, -1));
      const IntLanes upper = (v >= at(above, -1)) & (v >= at(above, 0)) & (v >= at(above, 1));
      const IntLanes lower = (v > at(below, -1)) & (v > at(below, 0)) & (v > at(below, 1));
      peak = __builtin_convertvector(row & upper & lower & 1, BytesOfLanes);
    }
    std::memcpy(peaks + x, &peak, static_cast<size_t>(extent.n));
  });
}

}  // namespace

extern const ImageKernels kImageKernels;
const ImageKernels kImageKernels = {DemosaicRow, WidenRow, HalveRows, BrightnessRow, SpotRow, PeakRow};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
