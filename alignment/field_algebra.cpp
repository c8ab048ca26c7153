#include "alignment/field_algebra.h"

namespace weft {
namespace {

double DotOfRange(const float* a, const float* b, SliceRange range) {
  float lanes[kLanes] = {};
  for (int s = range.first; s < range.last; ++s) {
    for (int l = 0; l < kLanes; ++l) lanes[l] += a[s * kLanes + l] * b[s * kLanes + l];
  }
  double sum = 0;
  for (const float lane : lanes) sum += lane;
  return sum;
}

}  // namespace

double Dot(const Field3& a, const Field3& b) {
  return SumOverBlocks(static_cast<int>(a.x.size()) / kLanes, [&](SliceRange range) {
    return DotOfRange(a.x.data(), b.x.data(), range) + DotOfRange(a.y.data(), b.y.data(), range) +
           DotOfRange(a.z.data(), b.z.data(), range);
  });
}

void Combine(const Field3& x, float scale, const Field3& y, Field3* out) {
  ForEachBlock(static_cast<int>(x.x.size()) / kLanes, [&](int, SliceRange range) {
    for (int i = range.first * kLanes; i < range.last * kLanes; ++i) out->x[i] = x.x[i] + scale * y.x[i];
    for (int i = range.first * kLanes; i < range.last * kLanes; ++i) out->y[i] = x.y[i] + scale * y.y[i];
    for (int i = range.first * kLanes; i < range.last * kLanes; ++i) out->z[i] = x.z[i] + scale * y.z[i];
  });
}

void AddScaled(float scale, const Field3& x, Field3* y) { Combine(*y, scale, x, y); }

}  // namespace weft
