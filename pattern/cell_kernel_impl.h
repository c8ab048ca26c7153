// Body of the cell kernels; see kernel_lanes.h.
#include "pattern/cell_kernel.h"
#include "pattern/kernel_lanes.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

constexpr Lanes kU = {-0.875f, -0.625f, -0.375f, -0.125f, 0.125f, 0.375f, 0.625f, 0.875f,
                      -0.875f, -0.625f, -0.375f, -0.125f, 0.125f, 0.375f, 0.625f, 0.875f};

// Rows of a group.
inline Lanes RowOf(int group) {
  const float upper = 0.5f * static_cast<float>(group) - 0.875f, lower = upper + 0.25f;
  return Lanes{upper, upper, upper, upper, upper, upper, upper, upper,
               lower, lower, lower, lower, lower, lower, lower, lower};
}

inline Lanes Abs(Lanes v) { return v < 0.0f ? -v : v; }

inline Lanes4 Folded(Lanes v) {
  const Lanes8 half = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
                      __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
  return __builtin_shufflevector(half, half, 0, 1, 2, 3) + __builtin_shufflevector(half, half, 4, 5, 6, 7);
}

// Sums over the lanes of `count` vectors.
inline void SumLanes(const Lanes* v, int count, float* out) {
  int k = 0;
  for (; k + 4 <= count; k += 4) {
    const Lanes4 a = Folded(v[k]), b = Folded(v[k + 1]), c = Folded(v[k + 2]), d = Folded(v[k + 3]);
    const Lanes4 ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5),
                 ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    const Lanes4 cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5),
                 cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    const Lanes4 ab = ab_low + ab_high, cd = cd_low + cd_high;
    const Lanes4 sum =
        __builtin_shufflevector(ab, cd, 0, 1, 4, 5) + __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
    std::memcpy(out + k, &sum, sizeof sum);
  }
  for (; k < count; ++k) {
    const Lanes4 a = Folded(v[k]);
    out[k] = (a[0] + a[2]) + (a[1] + a[3]);
  }
}

void Render(const CellLook& look, const float* mask, CellModel* model) {
  // Along the rows first: mixes of the colours of each board row, and their slopes.
  Lanes rows[5][3], slopes[5][3];
  for (int a = 0; a < 5; ++a) {
    for (int c = 0; c < 3; ++c) {
      Lanes row = {}, slope = {};
      for (int b = 0; b < 5; ++b) {
        row += look.colors[a][b][c] * Load(look.along_u->value[b]);
        slope += look.colors[a][b][c] * Load(look.along_u->slope[b]);
      }
      rows[a][c] = row;
      slopes[a][c] = slope;
    }
  }
  Lanes across[3];  // weights of the neighbours, per board row
  for (int a = 0; a < 3; ++a) {
    const float l = look.neighbor_weights[3 * a], m = look.neighbor_weights[3 * a + 1],
                r = look.neighbor_weights[3 * a + 2];
    across[a] = Lanes{l, l, m, m, m, m, r, r, l, l, m, m, m, m, r, r} * (1.0f - kU * kU);
  }
  static constexpr int kNear[kSampleGroups] = {0, 1, 1, 2};  // the board row of the group, one above the 3x3
  Lanes sums[51] = {};
  for (int m = 0; m < kSampleGroups; ++m) {
    const Lanes v = RowOf(m);
    const Lanes tent = (1.0f - Abs(kU)) * (1.0f - Abs(v));
    Lanes w = across[kNear[m]] * (1.0f - v * v);
    if (mask != nullptr) w *= Load(mask + kSampleLanes * m);
    Store(w, model->w[m]);
    Lanes uu = {}, uv = {}, vv = {}, ut = {}, vt = {}, u1 = {}, v1 = {}, tt = {}, t1 = {};
    const bool own = m == 1 || m == 2;
    Lanes shape = {};
    if (own) {
      constexpr Lanes kInside = {0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0};
      shape = kInside * Load(look.along_u->value[2]) * Load(look.along_v->value[m][2]);
      if (mask != nullptr) shape *= Load(mask + kSampleLanes * m);
      Store(shape, model->shape[m - 1]);
      sums[49] += shape;
      sums[50] += shape * shape;
    }
    for (int c = 0; c < 3; ++c) {
      Lanes t = Lanes{} + look.black[c], tu = {}, tv = {};
      for (int k = 0; k < 3; ++k) {
        const int a = kNear[m] + k;
        const Lanes p = Load(look.along_v->value[m][a]);
        t += rows[a][c] * p;
        tu += slopes[a][c] * p;
        tv += rows[a][c] * Load(look.along_v->slope[m][a]);
      }
      if (look.moves_center) {
        tu *= tent;
        tv *= tent;
      }
      const Lanes wt = w * t, wtu = w * tu, wtv = w * tv;
      Store(wt, model->wt[c][m]);
      Store(wtu, model->wtu[c][m]);
      Store(wtv, model->wtv[c][m]);
      uu += wtu * tu;
      uv += wtu * tv;
      vv += wtv * tv;
      ut += wtu * t;
      vt += wtv * t;
      u1 += wtu;
      v1 += wtv;
      tt += wt * t;
      t1 += wt;
      if (own) sums[46 + c] += shape * t;
    }
    const Lanes monomials[6] = {Lanes{} + 1.0f, kU, v, kU * kU, kU * v, v * v};
    for (int k = 0; k < 6; ++k) {
      sums[k] += uu * monomials[k];
      sums[6 + k] += uv * monomials[k];
      sums[12 + k] += vv * monomials[k];
      sums[18 + k] += ut * monomials[k];
      sums[24 + k] += vt * monomials[k];
      sums[30 + k] += tt * monomials[k];
    }
    for (int k = 0; k < 3; ++k) {
      sums[36 + k] += u1 * monomials[k];
      sums[39 + k] += v1 * monomials[k];
      sums[42 + k] += t1 * monomials[k];
    }
    sums[45] += w;
  }
  static_assert(sizeof(CellModelSums) == 51 * sizeof(float));
  SumLanes(sums, 51, model->sums.uu);
}

// The left (0) or right (1) pixels of 16 pairs.
inline IntLanes Pixels(const int32_t* pairs, int right) {
  return EveryOther(Int(pairs), Int(pairs + kSampleLanes), right);
}

void Sample(const PixelView& image, const CellFrame& frame, const CellBend& bend, CellSamples* samples) {
  const float x_last = static_cast<float>(image.width_px - 1) - 0.001f,
              y_last = static_cast<float>(image.height_px - 1) - 0.001f;
  // The position at v = 0 and its slopes over v and |v|, along the columns.
  const float center[2] = {frame.x, frame.y}, a[2] = {frame.ax, frame.ay}, b[2] = {frame.bx, frame.by};
  const Lanes abs_u = Abs(kU);
  Lanes middle[2], over_v[2], over_abs_v[2];
  for (int k = 0; k < 2; ++k) {
    middle[k] = center[k] + kU * a[k] + abs_u * bend.fold_u[k];
    over_v[k] = b[k] + kU * bend.twist[k] + abs_u * bend.fan_v[k];
    over_abs_v[k] = bend.fold_v[k] + kU * bend.fan_u[k] + abs_u * bend.rest[k];
  }
  // In steps over all samples: what is written by parts and read as a whole stalls when read at once.
  Lanes fx[kSampleGroups], fy[kSampleGroups];
  alignas(64) int32_t at[kSampleGroups * kSampleLanes];
  for (int m = 0; m < kSampleGroups; ++m) {
    const Lanes v = RowOf(m);
    const Lanes abs_v = Abs(v);
    Lanes x = middle[0] + v * over_v[0] + abs_v * over_abs_v[0];
    Lanes y = middle[1] + v * over_v[1] + abs_v * over_abs_v[1];
    x = x > 0.0f ? (x < x_last ? x : Lanes{} + x_last) : Lanes{};
    y = y > 0.0f ? (y < y_last ? y : Lanes{} + y_last) : Lanes{};
    const IntLanes xi = __builtin_convertvector(x, IntLanes), yi = __builtin_convertvector(y, IntLanes);
    fx[m] = x - __builtin_convertvector(xi, Lanes);
    fy[m] = y - __builtin_convertvector(yi, Lanes);
    const IntLanes offset = 4 * (yi * image.width_px + xi);
    std::memcpy(at + m * kSampleLanes, &offset, sizeof offset);
  }
  // Pixels and their right neighbours, and those below.
  alignas(64) int32_t upper[2 * kSampleGroups * kSampleLanes], lower[2 * kSampleGroups * kSampleLanes];
  const uint8_t* below = image.rgbx + 4 * static_cast<int64_t>(image.width_px);
  for (int k = 0; k < kSampleGroups * kSampleLanes; ++k) {
    std::memcpy(upper + 2 * k, image.rgbx + at[k], 8);
    std::memcpy(lower + 2 * k, below + at[k], 8);
  }
  for (int m = 0; m < kSampleGroups; ++m) {
    const int32_t *top = upper + 2 * m * kSampleLanes, *low = lower + 2 * m * kSampleLanes;
    const IntLanes pixel[4] = {Pixels(top, 0), Pixels(top, 1), Pixels(low, 0), Pixels(low, 1)};
    for (int c = 0; c < 3; ++c) {
      Lanes corner[4];
      for (int k = 0; k < 4; ++k) corner[k] = __builtin_convertvector((pixel[k] >> (8 * c)) & 255, Lanes);
      const Lanes above = corner[0] + fx[m] * (corner[1] - corner[0]),
                  under = corner[2] + fx[m] * (corner[3] - corner[2]);
      Store(above + fy[m] * (under - above), samples->value[c][m]);
    }
  }
}

void Sum(const CellModel& model, const CellSamples& samples, CellImageSums* out) {
  Lanes sums[16] = {};
  for (int m = 0; m < kSampleGroups; ++m) {
    const Lanes v = RowOf(m), w = Load(model.w[m]);
    Lanes ui = {}, vi = {}, ti = {}, ii = {};
    for (int c = 0; c < 3; ++c) {
      const Lanes i = Load(samples.value[c][m]);
      ui += Load(model.wtu[c][m]) * i;
      vi += Load(model.wtv[c][m]) * i;
      ti += Load(model.wt[c][m]) * i;
      const Lanes wi = w * i;
      ii += wi * i;
      sums[10 + c] += wi;
      if (m == 1 || m == 2) sums[13 + c] += Load(model.shape[m - 1]) * i;
    }
    sums[0] += ui;
    sums[1] += ui * kU;
    sums[2] += ui * v;
    sums[3] += vi;
    sums[4] += vi * kU;
    sums[5] += vi * v;
    sums[6] += ti;
    sums[7] += ti * kU;
    sums[8] += ti * v;
    sums[9] += ii;
  }
  static_assert(sizeof(CellImageSums) == 16 * sizeof(float));
  SumLanes(sums, 16, out->ui);
}

}  // namespace

extern const CellKernels kCellKernels;
const CellKernels kCellKernels = {Render, Sample, Sum};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
