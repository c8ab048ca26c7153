// Body of the image kernels; see kernel_lanes.h.
#include "pattern/image_kernel.h"
#include "pattern/kernel_lanes.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

typedef uint8_t Bytes32 __attribute__((vector_size(32)));
typedef int8_t Bytes16 __attribute__((vector_size(16)));

// Whole blocks of lanes, and what is left of a row after them.
template <int lanes>
struct Whole {
  static constexpr int n = lanes;
};
struct Part {
  int n;
};

template <int lanes, typename Body>
inline void ForBlocks(int width, Body body) {
  int x = 0;
  for (; x + lanes <= width; x += lanes) body(x, Whole<lanes>());
  if (x < width) body(x, Part{width - x});
}

template <typename Vector, typename Extent>
inline Vector LoadAs(const void* p, Extent extent, size_t bytes_per_lane) {
  Vector v = {};
  std::memcpy(&v, p, static_cast<size_t>(extent.n) * bytes_per_lane);
  return v;
}
template <typename Extent>
inline Lanes LoadFloats(const float* p, Extent extent) {
  return LoadAs<Lanes>(p, extent, sizeof(float));
}
template <typename Extent>
inline void StoreFloats(Lanes v, float* p, Extent extent) {
  std::memcpy(p, &v, static_cast<size_t>(extent.n) * sizeof(float));
}

inline Lanes Min(Lanes a, Lanes b) { return a < b ? a : b; }

void DemosaicRow(const uint8_t* above, const uint8_t* here, const uint8_t* below, int width, bool first_green,
                 bool with_red, uint8_t* __restrict__ out) {
  // Blocks begin at odd pixels.
  constexpr uint16_t kAll = 0xffff;
  constexpr ShortLanes kOddLanes = {0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll,
                                    0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll, 0, kAll};
  const ShortLanes green_here = first_green ? kOddLanes : ~kOddLanes;
  ForBlocks<32>(width - 2, [&](int k, auto extent) {
    const int x = k + 1;
    const auto at = [&](const uint8_t* row, int dx) {
      return __builtin_convertvector(LoadAs<Bytes32>(row + x + dx, extent, 1), ShortLanes);
    };
    const ShortLanes pixel = at(here, 0);
    const ShortLanes across = at(here, -1) + at(here, 1), down = at(above, 0) + at(below, 0);
    const ShortLanes diagonal = at(above, -1) + at(above, 1) + at(below, -1) + at(below, 1);
    const ShortLanes own = (green_here & ((across + 1) >> 1)) | (~green_here & pixel);
    const ShortLanes green = (green_here & pixel) | (~green_here & ((across + down + 2) >> 2));
    const ShortLanes other = (green_here & ((down + 1) >> 1)) | (~green_here & ((diagonal + 2) >> 2));
    const ShortLanes red_green = (with_red ? own : other) | (green << 8), blue = with_red ? other : own;
    const ShortLanes pixels[2] = {
        __builtin_shufflevector(red_green, blue, 0, 32, 1, 33, 2, 34, 3, 35, 4, 36, 5, 37, 6, 38, 7, 39, 8,
                                40, 9, 41, 10, 42, 11, 43, 12, 44, 13, 45, 14, 46, 15, 47),
        __builtin_shufflevector(red_green, blue, 16, 48, 17, 49, 18, 50, 19, 51, 20, 52, 21, 53, 22, 54, 23,
                                55, 24, 56, 25, 57, 26, 58, 27, 59, 28, 60, 29, 61, 30, 62, 31, 63)};
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
  ForBlocks<16>(half_width, [&](int x, auto extent) {
    const int first = extent.n < 8 ? extent.n : 8, rest = extent.n - first;
    IntLanes even = {}, odd = {};
    const uint8_t* const rows[] = {upper, lower};
    for (const uint8_t* row : rows) {
      const uint8_t* p = row + 8 * x;
      IntLanes low = {}, high = {};
      std::memcpy(&low, p, static_cast<size_t>(first) * 8);
      std::memcpy(&high, p + 64, static_cast<size_t>(rest) * 8);
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
  ForBlocks<16>(width, [&](int x, auto extent) {
    const IntLanes pixel = LoadAs<IntLanes>(rgbx + 4 * x, extent, 4);
    const IntLanes red = pixel & 255, green = (pixel >> 8) & 255, blue = (pixel >> 16) & 255;
    IntLanes most = red > green ? red : green;
    most = most > blue ? most : blue;
    StoreFloats(Log(__builtin_convertvector(most + kOffset, Lanes)), out + x, extent);
  });
}

void SpotRow(const float* const* rows, const float* narrow, int narrow_reach, const float* wide, int reach,
             int width, float* __restrict__ scratch, float* __restrict__ out) {
  float *near = scratch + reach, *far = near + width + 2 * reach;
  ForBlocks<16>(width, [&](int x, auto extent) {
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
  ForBlocks<16>(width, [&](int x, auto extent) {
    Lanes n = narrow[0] * LoadFloats(near + x, extent), w = wide[0] * LoadFloats(far + x, extent);
    const auto both = [&](const float* mid, int k) {
      return LoadFloats(mid + x - k, extent) + LoadFloats(mid + x + k, extent);
    };
    for (int k = 1; k <= narrow_reach; ++k) n += narrow[k] * both(near, k);
    for (int k = 1; k <= reach; ++k) w += wide[k] * both(far, k);
    StoreFloats(n - w, out + x, extent);
  });
}

void PeakRow(const float* const* rows, float contrast, int width, float* __restrict__ scratch,
             uint8_t* __restrict__ peaks) {
  constexpr int kReach = 3;
  float* least = scratch + kReach;
  ForBlocks<16>(width, [&](int x, auto extent) {
    Lanes low = LoadFloats(rows[0] + x, extent);
    for (int k = 1; k <= 2 * kReach; ++k) low = Min(low, LoadFloats(rows[k] + x, extent));
    StoreFloats(low, least + x, extent);
  });
  for (int k = 1; k <= kReach; ++k) {
    least[-k] = least[0];
    least[width - 1 + k] = least[width - 1];
  }
  const float *above = rows[kReach - 1], *here = rows[kReach], *below = rows[kReach + 1];
  ForBlocks<16>(width - 2, [&](int k, auto extent) {
    const int x = k + 1;
    const auto at = [&](const float* row, int dx) { return LoadFloats(row + x + dx, extent); };
    const Lanes v = at(here, 0);
    Lanes low = at(least, 0);
    for (int d = 1; d <= kReach; ++d) low = Min(low, Min(at(least, -d), at(least, d)));
    const IntLanes row = (v > 0.0f) & (v - low >= contrast) & (v > at(here, 1)) & (v >= at(here, -1));
    const IntLanes upper = (v >= at(above, -1)) & (v >= at(above, 0)) & (v >= at(above, 1));
    const IntLanes lower = (v > at(below, -1)) & (v > at(below, 0)) & (v > at(below, 1));
    const Bytes16 peak = __builtin_convertvector(row & upper & lower & 1, Bytes16);
    std::memcpy(peaks + x, &peak, static_cast<size_t>(extent.n));
  });
}

}  // namespace

extern const ImageKernels kImageKernels;
const ImageKernels kImageKernels = {DemosaicRow, WidenRow, HalveRows, BrightnessRow, SpotRow, PeakRow};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
