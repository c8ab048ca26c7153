// Body of the cell kernels; see simd/lanes.h.
#include "pattern/fit/cell_kernel.h"
#include "simd/lanes.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

// The 16 samples of a group are taken in parts of kLanes. Constants of a sample, by place in its group; v by
// group as well.
struct alignas(64) SampleConstants {
  float u[kSampleLanes] = {}, abs_u[kSampleLanes] = {}, uu[kSampleLanes] = {};
  float window_u[kSampleLanes] = {}, tent_u[kSampleLanes] = {};
  float v[kSampleGroups][kSampleLanes] = {}, abs_v[kSampleGroups][kSampleLanes] = {},
        vv[kSampleGroups][kSampleLanes] = {}, uv[kSampleGroups][kSampleLanes] = {},
        window_v[kSampleGroups][kSampleLanes] = {}, tent_v[kSampleGroups][kSampleLanes] = {};
  // 1 for the columns of the left, middle and right cell, and of the middle of the cell.
  float side[3][kSampleLanes] = {}, inside[kSampleLanes] = {};

  constexpr SampleConstants() {
    const auto abs = [](float x) { return x < 0 ? -x : x; };
    for (int l = 0; l < kSampleLanes; ++l) {
      const int column = l % kCellSide;
      const float x = CellSample(column);
      u[l] = x;
      abs_u[l] = abs(x);
      uu[l] = x * x;
      window_u[l] = 1 - x * x;
      tent_u[l] = 1 - abs(x);
      side[column < 2 ? 0 : (column < 6 ? 1 : 2)][l] = 1;
      inside[l] = column >= 2 && column < 6 ? 1.0f : 0.0f;
      for (int m = 0; m < kSampleGroups; ++m) {
        const float y = CellSample(2 * m + l / kCellSide);
        v[m][l] = y;
        abs_v[m][l] = abs(y);
        vv[m][l] = y * y;
        uv[m][l] = x * y;
        window_v[m][l] = 1 - y * y;
        tent_v[m][l] = 1 - abs(y);
      }
    }
  }
};
constexpr SampleConstants kAt;
constexpr int kSamples = kSampleGroups * kSampleLanes;

// The board row of a group of samples, one above the 3x3.
constexpr int kNear[kSampleGroups] = {0, 1, 1, 2};
constexpr bool IsMiddle(int group) { return group == 1 || group == 2; }

// Sums of many quantities over the samples of a group, to be added up.
template <int quantities>
struct alignas(64) LaneSums {
  float lanes[quantities][kSampleLanes];

  void AddUp(float* out) const {
    const auto folded = [this](int k) {
      const float* p = lanes[k];
      return (LoadAs<Lanes4>(p) + LoadAs<Lanes4>(p + 8)) + (LoadAs<Lanes4>(p + 4) + LoadAs<Lanes4>(p + 12));
    };
    int k = 0;
    for (; k + 4 <= quantities; k += 4) {
      const Lanes4 a = folded(k), b = folded(k + 1), c = folded(k + 2), d = folded(k + 3);
      const Lanes4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5) + __builtin_shufflevector(a, b, 2, 6, 3, 7),
                   cd = __builtin_shufflevector(c, d, 0, 4, 1, 5) + __builtin_shufflevector(c, d, 2, 6, 3, 7);
      const Lanes4 sum =
          __builtin_shufflevector(ab, cd, 0, 1, 4, 5) + __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
      std::memcpy(out + k, &sum, sizeof sum);
    }
    for (; k < quantities; ++k) {
      const Lanes4 a = folded(k);
      out[k] = (a[0] + a[2]) + (a[1] + a[3]);
    }
  }
};

// Mixes of the colours of each board row along the columns of samples, and their slopes.
struct alignas(64) RowMixes {
  float value[5][3][kCellSide], slope[5][3][kCellSide];

  explicit RowMixes(const CellPrint& print) {
    constexpr int kWidth = kLanes < kCellSide ? kLanes : kCellSide;
    typedef float Columns __attribute__((vector_size(4 * kWidth)));
    for (int first = 0; first < kCellSide; first += kWidth) {
      Columns along[5], slope_along[5];
      for (int b = 0; b < 5; ++b) {
        along[b] = LoadAs<Columns>(print.along_u->value[b] + first);
        slope_along[b] = LoadAs<Columns>(print.along_u->slope[b] + first);
      }
      for (int a = 0; a < 5; ++a) {
        for (int c = 0; c < 3; ++c) {
          Columns row = {}, row_slope = {};
          for (int b = 0; b < 5; ++b) {
            row += print.colors[a][b][c] * along[b];
            row_slope += print.colors[a][b][c] * slope_along[b];
          }
          std::memcpy(value[a][c] + first, &row, sizeof row);
          std::memcpy(slope[a][c] + first, &row_slope, sizeof row_slope);
        }
      }
    }
  }

  // The part of a group's samples that begins at lane `first`: both of its rows have the same columns.
  static Lanes Part(const float* columns, int first) {
#if defined(__AVX512F__)
    typedef float Columns __attribute__((vector_size(4 * kCellSide)));
    const Columns v = LoadAs<Columns>(columns + first);
    return __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7);
#else
    return Load(columns + first % kCellSide);
#endif
  }
};

// Products of a part of the samples, by group. Not set to zero as a whole, which takes a tenth of the time.
struct Products {
  Lanes uu[kSampleGroups], uv[kSampleGroups], vv[kSampleGroups], ut[kSampleGroups], vt[kSampleGroups],
      tt[kSampleGroups], u1[kSampleGroups], v1[kSampleGroups], t1[kSampleGroups];
};

// Sums over the groups of products times the first `count` of the monomials 1, u, v, uu, uv, vv.
template <int count>
inline void SumMonomials(const Lanes* products, int first, float (*sums)[kSampleLanes]) {
  Lanes sum[count] = {};
  for (int m = 0; m < kSampleGroups; ++m) {
    const Lanes p = products[m];
    const float* const monomials[6] = {nullptr, kAt.u, kAt.v[m], kAt.uu, kAt.uv[m], kAt.vv[m]};
    sum[0] += p;
    for (int k = 1; k < count; ++k) sum[k] += p * Load(monomials[k] + first);
  }
  for (int k = 0; k < count; ++k) Store(sum[k], sums[k] + first);
}

// Renders the part of each group's samples that begins at lane `first`. The sums come in the order of
// CellModelSums; those of a moving centre without the ones that stay zero.
template <bool moves_center>
inline void RenderPart(const CellPrint& print, const RowMixes& mixes, const float* mask, int first,
                       CellModel* model, float (*sums)[kSampleLanes]) {
  Products products;
  Lanes weight = {}, shape_t[3] = {}, shape_1 = {}, shape_2 = {};
  for (int m = 0; m < kSampleGroups; ++m) {
    const float* near = print.neighbor_weights + 3 * kNear[m];
    const Lanes side = near[0] * Load(kAt.side[0] + first) + near[1] * Load(kAt.side[1] + first) +
                       near[2] * Load(kAt.side[2] + first);
    Lanes w = side * Load(kAt.window_u + first) * Load(kAt.window_v[m] + first);
    if (mask != nullptr) w *= Load(mask + kSampleLanes * m + first);
    Store(w, model->w[m] + first);
    weight += w;
    Lanes shape = {};
    if (IsMiddle(m)) {
      shape = Load(kAt.inside + first) * RowMixes::Part(print.along_u->value[2], first) *
              Load(print.along_v->value[m][2] + first);
      if (mask != nullptr) shape *= Load(mask + kSampleLanes * m + first);
      Store(shape, model->shape[m - 1] + first);
      shape_1 += shape;
      shape_2 += shape * shape;
    }
    const Lanes tent = Load(kAt.tent_u + first) * Load(kAt.tent_v[m] + first);
    Lanes uu = {}, uv = {}, vv = {}, ut = {}, vt = {}, tt = {}, u1 = {}, v1 = {}, t1 = {};
    for (int c = 0; c < 3; ++c) {
      Lanes t = Lanes{} + print.black[c], tu = {}, tv = {};
      for (int k = 0; k < 3; ++k) {
        const int a = kNear[m] + k;
        const Lanes p = Load(print.along_v->value[m][a] + first);
        const Lanes row = RowMixes::Part(mixes.value[a][c], first);
        t += row * p;
        tu += RowMixes::Part(mixes.slope[a][c], first) * p;
        tv += row * Load(print.along_v->slope[m][a] + first);
      }
      if (moves_center) {
        tu *= tent;
        tv *= tent;
      }
      const Lanes wt = w * t, wtu = w * tu, wtv = w * tv;
      Store(wt, model->wt[c][m] + first);
      Store(wtu, model->wtu[c][m] + first);
      Store(wtv, model->wtv[c][m] + first);
      uu += wtu * tu;
      uv += wtu * tv;
      vv += wtv * tv;
      ut += wtu * t;
      vt += wtv * t;
      u1 += wtu;
      v1 += wtv;
      tt += wt * t;
      t1 += wt;
      if (IsMiddle(m)) shape_t[c] += shape * t;
    }
    products.uu[m] = uu, products.uv[m] = uv, products.vv[m] = vv;
    products.ut[m] = ut, products.vt[m] = vt, products.tt[m] = tt;
    products.u1[m] = u1, products.v1[m] = v1, products.t1[m] = t1;
  }
  constexpr int kSlopes = moves_center ? 1 : 6, kMixed = moves_center ? 3 : 6, kPlain = moves_center ? 1 : 3;
  SumMonomials<kSlopes>(products.uu, first, sums);
  SumMonomials<kSlopes>(products.uv, first, sums += kSlopes);
  SumMonomials<kSlopes>(products.vv, first, sums += kSlopes);
  SumMonomials<kMixed>(products.ut, first, sums += kSlopes);
  SumMonomials<kMixed>(products.vt, first, sums += kMixed);
  SumMonomials<6>(products.tt, first, sums += kMixed);
  SumMonomials<kPlain>(products.u1, first, sums += 6);
  SumMonomials<kPlain>(products.v1, first, sums += kPlain);
  SumMonomials<3>(products.t1, first, sums += kPlain);
  Store(weight, sums[3] + first);
  for (int c = 0; c < 3; ++c) Store(shape_t[c], sums[4 + c] + first);
  Store(shape_1, sums[7] + first);
  Store(shape_2, sums[8] + first);
}

void Render(const CellPrint& print, const float* mask, CellModel* model) {
  static_assert(sizeof(CellModelSums) == 51 * sizeof(float));
  const RowMixes mixes(print);
  float all[51] = {};
  if (print.moves_center) {
    static constexpr int kPlaces[] = {0,  6,  12, 18, 19, 20, 24, 25, 26, 30, 31, 32, 33,
                                      34, 35, 36, 39, 42, 43, 44, 45, 46, 47, 48, 49, 50};
    constexpr int kSums = sizeof kPlaces / sizeof *kPlaces;
    LaneSums<kSums> sums;
    for (int first = 0; first < kSampleLanes; first += kLanes)
      RenderPart<true>(print, mixes, mask, first, model, sums.lanes);
    float total[kSums];
    sums.AddUp(total);
    for (int k = 0; k < kSums; ++k) all[kPlaces[k]] = total[k];
  } else {
    LaneSums<51> sums;
    for (int first = 0; first < kSampleLanes; first += kLanes)
      RenderPart<false>(print, mixes, mask, first, model, sums.lanes);
    sums.AddUp(all);
  }
  std::memcpy(&model->sums, all, sizeof all);
}

inline Lanes Clamped(Lanes v, float last) {
  v = v > 0.0f ? v : Lanes{};
  return v < last ? v : Lanes{} + last;
}

void Sample(const PixelView& image, const CellPose& pose, const CellWarp& warp, CellSamples* samples) {
  const float x_last = static_cast<float>(image.width_px - 1) - 0.001f,
              y_last = static_cast<float>(image.height_px - 1) - 0.001f;
  const float center[2] = {pose.x, pose.y}, a[2] = {pose.ax, pose.ay}, b[2] = {pose.bx, pose.by};
  // In steps over all samples: what is written by parts and read as a whole stalls when read at once.
  alignas(64) float fx[kSamples], fy[kSamples];
  alignas(64) int32_t at[kSamples];
  for (int first = 0; first < kSampleLanes; first += kLanes) {
    // The position at v = 0 and its slopes over v and |v|, along the columns.
    const Lanes u = Load(kAt.u + first), abs_u = Load(kAt.abs_u + first);
    Lanes middle[2], over_v[2], over_abs_v[2];
    for (int k = 0; k < 2; ++k) {
      middle[k] = center[k] + u * a[k] + abs_u * warp.fold_u[k];
      over_v[k] = b[k] + u * warp.twist[k] + abs_u * warp.fan_v[k];
      over_abs_v[k] = warp.fold_v[k] + u * warp.fan_u[k] + abs_u * warp.rest[k];
    }
    for (int m = 0; m < kSampleGroups; ++m) {
      const Lanes v = Load(kAt.v[m] + first), abs_v = Load(kAt.abs_v[m] + first);
      const Lanes x = Clamped(middle[0] + v * over_v[0] + abs_v * over_abs_v[0], x_last);
      const Lanes y = Clamped(middle[1] + v * over_v[1] + abs_v * over_abs_v[1], y_last);
      const IntLanes xi = __builtin_convertvector(x, IntLanes), yi = __builtin_convertvector(y, IntLanes);
      const int k = m * kSampleLanes + first;
      Store(x - __builtin_convertvector(xi, Lanes), fx + k);
      Store(y - __builtin_convertvector(yi, Lanes), fy + k);
      const IntLanes offset = 4 * (yi * image.width_px + xi);
      std::memcpy(at + k, &offset, sizeof offset);
    }
  }
  // Pixels and their right neighbours, and those below.
  alignas(64) int32_t upper[2 * kSamples], lower[2 * kSamples];
  const uint8_t* below = image.rgbx + 4 * static_cast<int64_t>(image.width_px);
  for (int k = 0; k < kSamples; ++k) {
    std::memcpy(upper + 2 * k, image.rgbx + at[k], 8);
    std::memcpy(lower + 2 * k, below + at[k], 8);
  }
  for (int first = 0; first < kSamples; first += kLanes) {
    const auto pixels = [first](const int32_t* pairs, int right) {
      return EveryOther(LoadAs<IntLanes>(pairs + 2 * first), LoadAs<IntLanes>(pairs + 2 * first + kLanes),
                        right);
    };
    const IntLanes pixel[4] = {pixels(upper, 0), pixels(upper, 1), pixels(lower, 0), pixels(lower, 1)};
    const Lanes x = Load(fx + first), y = Load(fy + first);
    for (int c = 0; c < 3; ++c) {
      Lanes corner[4];
      for (int k = 0; k < 4; ++k) corner[k] = __builtin_convertvector((pixel[k] >> (8 * c)) & 255, Lanes);
      const Lanes above = corner[0] + x * (corner[1] - corner[0]),
                  under = corner[2] + x * (corner[3] - corner[2]);
      float* const values = samples->value[c][0];  // of all groups, one after the other
      Store(above + y * (under - above), values + first);
    }
  }
}

void Sum(const CellModel& model, const CellSamples& samples, CellImageSums* out) {
  static_assert(sizeof(CellImageSums) == 16 * sizeof(float));
  LaneSums<16> all;
  for (int first = 0; first < kSampleLanes; first += kLanes) {
    const Lanes u = Load(kAt.u + first);
    Lanes sums[16] = {};
    for (int m = 0; m < kSampleGroups; ++m) {
      const Lanes v = Load(kAt.v[m] + first), w = Load(model.w[m] + first);
      Lanes ui = {}, vi = {}, ti = {}, ii = {};
      for (int c = 0; c < 3; ++c) {
        const Lanes i = Load(samples.value[c][m] + first);
        ui += Load(model.wtu[c][m] + first) * i;
        vi += Load(model.wtv[c][m] + first) * i;
        ti += Load(model.wt[c][m] + first) * i;
        const Lanes wi = w * i;
        ii += wi * i;
        sums[10 + c] += wi;
        if (IsMiddle(m)) sums[13 + c] += Load(model.shape[m - 1] + first) * i;
      }
      sums[0] += ui;
      sums[1] += ui * u;
      sums[2] += ui * v;
      sums[3] += vi;
      sums[4] += vi * u;
      sums[5] += vi * v;
      sums[6] += ti;
      sums[7] += ti * u;
      sums[8] += ti * v;
      sums[9] += ii;
    }
    for (int k = 0; k < 16; ++k) Store(sums[k], all.lanes[k] + first);
  }
  float total[16];
  all.AddUp(total);
  std::memcpy(out, total, sizeof total);
}

void Trust(const CellModel& model, const CellSamples& samples, const float* light, float* weights) {
  constexpr float kScale2 = 2.0f;       // of the distribution, squared, in mean squared residuals
  constexpr float kLeastScale2 = 9.0f;  // in squared grey levels
  alignas(64) float weighted[kSamples];
  for (int m = 0; m < kSampleGroups; ++m) {
    for (int first = 0; first < kSampleLanes; first += kLanes) {
      const Lanes gain = light[0] + light[1] * Load(kAt.u + first) + light[2] * Load(kAt.v[m] + first);
      const Lanes weight = Load(model.w[m] + first);
      Lanes squared = {};
      for (int c = 0; c < 3; ++c) {
        const Lanes residual =
            weight * (Load(samples.value[c][m] + first) - light[3]) - gain * Load(model.wt[c][m] + first);
        squared += residual * residual;
      }
      Store(weight > 0.0f ? squared / (3.0f * weight) : Lanes{}, weighted + kSampleLanes * m + first);
    }
  }
  float sum = 0;  // one by one, as on every instruction set
  for (const float w : weighted) sum += w;
  const float mean_scale2 = kScale2 * sum / model.sums.weight;
  const float scale2 = mean_scale2 > kLeastScale2 ? mean_scale2 : kLeastScale2;
  for (int m = 0; m < kSampleGroups; ++m) {
    for (int first = 0; first < kSampleLanes; first += kLanes) {
      const Lanes weight = Load(model.w[m] + first);
      const Lanes squared = Load(weighted + kSampleLanes * m + first) / weight;
      Store(weight > 0.0f ? scale2 / (scale2 + squared) : Lanes{}, weights + kSampleLanes * m + first);
    }
  }
}

void Colors(const CellInks& cell, const CellSamples& samples, CellColorSums* out) {
  constexpr int kUnknowns = kCellColors + 1;
  typedef double Shares __attribute__((vector_size(8 * kUnknowns)));
  typedef double WideLanes __attribute__((vector_size(8 * kLanes)));
  const auto add = [](WideLanes more, double* sum) {
    more += LoadAs<WideLanes>(sum);
    std::memcpy(sum, &more, sizeof more);
  };
  Shares normal[kUnknowns] = {}, target[3] = {};
  double square = 0;
  for (int m = 0; m < kSampleGroups; ++m) {
    alignas(64) double shares[kUnknowns][kSampleLanes] = {};
    for (int first = 0; first < kSampleLanes; first += kLanes) {
      WideLanes covered = {};
      for (int k = 0; k < 25; ++k) {
        const Lanes share =
            Load(cell.along_v->value[m][k / 5] + first) * RowMixes::Part(cell.along_u->value[k % 5], first);
        covered += __builtin_convertvector(share, WideLanes);
        add(__builtin_convertvector(share, WideLanes), shares[cell.inks[k / 5][k % 5]] + first);
      }
      add(1 - covered, shares[kCellColors] + first);
    }
    for (int l = 0; l < kSampleLanes; ++l) {
      const double weight = cell.weights[m * kSampleLanes + l];
      Shares weighted;
      for (int p = 0; p < kUnknowns; ++p) weighted[p] = weight * shares[p][l];
      for (int q = 0; q < kUnknowns; ++q) normal[q] += weighted * shares[q][l];
      for (int c = 0; c < 3; ++c) {
        const double value = samples.value[c][m][l];
        target[c] += weighted * value;
        square += weight * value * value;
      }
    }
  }
  std::memcpy(out->normal, normal, sizeof normal);
  std::memcpy(out->target, target, sizeof target);
  out->square = square;
}

}  // namespace

const CellKernels kCellKernels = {Render, Sample, Sum, Trust, Colors};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
