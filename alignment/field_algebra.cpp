#include "alignment/field_algebra.h"

namespace weft {
namespace {

double DotOfRange(const float* a, const float* b, SliceRange range) {
  float lanes[kSliceLanes] = {};
  for (int s = range.first; s < range.last; ++s) {
    for (int l = 0; l < kSliceLanes; ++l) lanes[l] += a[s * kSliceLanes + l] * b[s * kSliceLanes + l];
  }
  double sum = 0;
  for (const float lane : lanes) sum += lane;
  return sum;
}

}  // namespace

double Dot(const Field3& a, const Field3& b) {
  return SumOverBlocks(static_cast<int>(a.x.size()) / kSliceLanes, [&](SliceRange range) {
    return DotOfRange(a.x.data(), b.x.data(), range) + DotOfRange(a.y.data(), b.y.data(), range) +
           DotOfRange(a.z.data(), b.z.data(), range);
  });
}

void Combine(const Field3& x, float scale, const Field3& y, Field3* out) {
  ForEachBlock(static_cast<int>(x.x.size()) / kSliceLanes, [&](int, SliceRange range) {
    for (int i = range.first * kSliceLanes; i < range.last * kSliceLanes; ++i)
      out->x[i] = x.x[i] + scale * y.x[i];
    for (int i = range.first * kSliceLanes; i < range.last * kSliceLanes; ++i)
      out->y[i] = x.y[i] + scale * y.y[i];
    for (int i = range.first * kSliceLanes; i < range.last * kSliceLanes; ++i)
      out->z[i] = x.z[i] + scale * y.z[i];
  });
}

void AddScaled(float scale, const Field3& x, Field3* y) { Combine(*y, scale, x, y); }

void PackRecords(const Field3& in, Records* out) {
  ForEachBlock(static_cast<int>(in.x.size()) / kSliceLanes, [&](int, SliceRange range) {
    for (int i = range.first * kSliceLanes; i < range.last * kSliceLanes; ++i) {
      float* const record = out->data() + 4 * static_cast<size_t>(i);
      record[0] = in.x[i], record[1] = in.y[i], record[2] = in.z[i], record[3] = 0;
    }
  });
}

}  // namespace weft
