// Body of the ray kernels: 16 rays at a time on every processor, so that all of them give the same bytes. A
// file per instruction set defines WEFT_KERNEL_NAMESPACE before it includes this; no inline function of a
// library is used, so that no code for one processor gets into what others run.
#include <cstdint>
#include <cstring>

#include "triangulation/ray_kernel.h"

#ifndef WEFT_KERNEL_NAMESPACE
#define WEFT_KERNEL_NAMESPACE baseline
#endif

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

typedef float Lanes __attribute__((vector_size(64)));
typedef int32_t IntLanes __attribute__((vector_size(64)));
typedef float Lanes8 __attribute__((vector_size(32)));
typedef float Lanes4 __attribute__((vector_size(16)));
typedef double Doubles __attribute__((vector_size(64)));  // half as many lanes

inline Lanes Load(const float* p) {
  Lanes v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void Store(Lanes v, float* p) { std::memcpy(p, &v, sizeof v); }
// Lanes 0, 2, 4 ... (odd = 0) or 1, 3, 5 ... (1) of two vectors behind each other.
inline IntLanes EveryOther(IntLanes low, IntLanes high, int odd) {
  return odd == 0
             ? __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30)
             : __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
}
inline Doubles LoadDoubles(const double* p) {
  Doubles v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void StoreDoubles(Doubles v, double* p) { std::memcpy(p, &v, sizeof v); }

inline Lanes Short(Doubles low, Doubles high) {
  const Lanes8 a = __builtin_convertvector(low, Lanes8), b = __builtin_convertvector(high, Lanes8);
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}
inline Doubles LongLow(Lanes v) {
  return __builtin_convertvector(__builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7), Doubles);
}
inline Doubles LongHigh(Lanes v) {
  return __builtin_convertvector(__builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15), Doubles);
}
inline Lanes Abs(Lanes v) { return v < 0.0f ? -v : v; }
inline Lanes Max(Lanes a, Lanes b) { return a > b ? a : b; }

inline float SumLanes(Lanes v) {
  const Lanes8 a = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
                   __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
  const Lanes4 b = __builtin_shufflevector(a, a, 0, 1, 2, 3) + __builtin_shufflevector(a, a, 4, 5, 6, 7);
  return (b[0] + b[2]) + (b[1] + b[3]);
}
// Whether a comparison holds in any lane.
inline bool Any(IntLanes mask) {
  typedef int64_t LongLanes __attribute__((vector_size(64)));
  LongLanes v;
  std::memcpy(&v, &mask, sizeof v);
  return ((v[0] | v[1]) | (v[2] | v[3]) | (v[4] | v[5]) | (v[6] | v[7])) != 0;
}
inline IntLanes Number(int first) {
  return IntLanes{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15} + first;
}

// Columns of an 8x8 matrix to rows.
inline void Transpose(Doubles* v) {
  Doubles a[8], b[8];
  for (int i = 0; i < 8; i += 2) {
    a[i] = __builtin_shufflevector(v[i], v[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    a[i + 1] = __builtin_shufflevector(v[i], v[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int j = i; j < i + 2; ++j) {
      b[j] = __builtin_shufflevector(a[j], a[j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      b[j + 2] = __builtin_shufflevector(a[j], a[j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (int i = 0; i < 4; ++i) {
    v[i] = __builtin_shufflevector(b[i], b[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    v[i + 4] = __builtin_shufflevector(b[i], b[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}
template <typename To, typename From>
inline To Bits(From v) {
  To out;
  std::memcpy(&out, &v, sizeof out);
  return out;
}
// Two columns of 16 short numbers as one of pairs, for the first (half 0) or last eight rays.
inline Doubles Pairs(IntLanes a, IntLanes b, int half) {
  return Bits<Doubles>(
      half == 0
          ? __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23)
          : __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31));
}

// The lens model at a point of the plane z = 1 (CameraModel): where the point is seen.
template <typename V, typename T>
inline void Distort(const T* d, V x, V y, V* seen_x, V* seen_y, V* radial, V* radial_slope) {
  const V r2 = x * x + y * y;
  const V denominator = T(1) + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
  *radial = (T(1) + r2 * (d[0] + r2 * (d[1] + r2 * d[4]))) / denominator;
  if (radial_slope != nullptr) {
    *radial_slope = ((d[0] + r2 * (T(2) * d[1] + r2 * T(3) * d[4])) -
                     *radial * (d[5] + r2 * (T(2) * d[6] + r2 * T(3) * d[7]))) /
                    denominator;
  }
  *seen_x = x * *radial + T(2) * d[2] * x * y + d[3] * (r2 + T(2) * x * x);
  *seen_y = y * *radial + d[2] * (r2 + T(2) * y * y) + T(2) * d[3] * x * y;
}

// Newton's method in floats, then one step in doubles with the last Jacobian.
void UnprojectGroup(const RayCamera& camera, const float* lens, int first, RayColumns* out) {
  constexpr int kMaxIterations = 8;
  constexpr float kFloatTolerance = 1e-6f;
  Doubles goal[2][2];  // [axis][half]
  for (int half = 0; half < 2; ++half) {
    goal[0][half] = (LoadDoubles(out->x_px + first + 8 * half) - camera.cx_px) / camera.fx_px;
    goal[1][half] = (LoadDoubles(out->y_px + first + 8 * half) - camera.cy_px) / camera.fy_px;
  }
  const Lanes goal_x = Short(goal[0][0], goal[0][1]), goal_y = Short(goal[1][0], goal[1][1]);
  Lanes x = goal_x, y = goal_y, seen_x, seen_y, radial, slope, xx, xy, yy, determinant;
  for (int i = 0;; ++i) {
    Distort<Lanes, float>(lens, x, y, &seen_x, &seen_y, &radial, &slope);
    xx = radial + 2.0f * x * x * slope + 2.0f * lens[2] * y + 6.0f * lens[3] * x;
    xy = 2.0f * x * y * slope + 2.0f * lens[2] * x + 2.0f * lens[3] * y;
    yy = radial + 2.0f * y * y * slope + 6.0f * lens[2] * y + 2.0f * lens[3] * x;
    determinant = 1.0f / (xx * yy - xy * xy);
    const Lanes off_x = seen_x - goal_x, off_y = seen_y - goal_y;
    if (i == kMaxIterations || !Any((Abs(off_x) + Abs(off_y)) > kFloatTolerance)) break;
    x -= (yy * off_x - xy * off_y) * determinant;
    y -= (xx * off_y - xy * off_x) * determinant;
  }
  Lanes off[2], exact[2];
  Doubles long_x[2] = {LongLow(x), LongHigh(x)}, long_y[2] = {LongLow(y), LongHigh(y)};
  Doubles off_x[2], off_y[2];
  for (int half = 0; half < 2; ++half) {
    Doubles at_x, at_y, unused;
    Distort<Doubles, double>(camera.distortion, long_x[half], long_y[half], &at_x, &at_y, &unused, nullptr);
    off_x[half] = at_x - goal[0][half];
    off_y[half] = at_y - goal[1][half];
  }
  off[0] = Short(off_x[0], off_x[1]);
  off[1] = Short(off_y[0], off_y[1]);
  exact[0] = (yy * off[0] - xy * off[1]) * determinant;
  exact[1] = (xx * off[1] - xy * off[0]) * determinant;
  const double* r = camera.rotation;
  Doubles along[3][2];
  for (int half = 0; half < 2; ++half) {
    long_x[half] -= half == 0 ? LongLow(exact[0]) : LongHigh(exact[0]);
    long_y[half] -= half == 0 ? LongLow(exact[1]) : LongHigh(exact[1]);
    for (int k = 0; k < 3; ++k) along[k][half] = r[k] * long_x[half] + r[3 + k] * long_y[half] + r[6 + k];
  }
  const float fx = static_cast<float>(camera.fx_px), fy = static_cast<float>(camera.fy_px);
  const Lanes pixel[2][2] = {{fx * xx, fx * xy}, {fy * xy, fy * yy}};
  Lanes pixel_from_offset[6];
  for (int row = 0; row < 2; ++row) {
    const Lanes depth = pixel[row][0] * x + pixel[row][1] * y;
    for (int k = 0; k < 3; ++k) {
      pixel_from_offset[3 * row + k] = pixel[row][0] * static_cast<float>(r[k]) +
                                       pixel[row][1] * static_cast<float>(r[3 + k]) -
                                       depth * static_cast<float>(r[6 + k]);
    }
  }
  const IntLanes valid = ((Abs(off[0]) + Abs(off[1])) < 2 * kFloatTolerance) &
                         ((x * x + y * y) < static_cast<float>(camera.safe_square)) &
                         (Abs(determinant) < 1e6f);
  for (int half = 0; half < 2; ++half) {
    Doubles rows[8] = {along[0][half], along[1][half], along[2][half]};
    for (int k = 0; k < 3; ++k)
      rows[3 + k] =
          Pairs(Bits<IntLanes>(pixel_from_offset[2 * k]), Bits<IntLanes>(pixel_from_offset[2 * k + 1]), half);
    rows[6] = Doubles{};
    rows[7] = Pairs(valid, IntLanes{}, half);
    Transpose(rows);
    std::memcpy(static_cast<void*>(out->rays + first + 8 * half), rows, sizeof rows);
  }
}

void Unproject(const RayCamera& camera, int count, RayColumns* columns) {
  float lens[8];
  for (int k = 0; k < 8; ++k) lens[k] = static_cast<float>(camera.distortion[k]);
  for (int first = 0; first < count; first += kRayLanes) UnprojectGroup(camera, lens, first, columns);
}

void LocaliseTile(const RayCamera* cameras, const RayRecord* records, IntLanes has_ray,
                  const double* reference_mm, const RayLimits& limits, LocalTile* local) {
  Doubles columns[2][8], foot[2][3], square[2], distance[2];
  for (int half = 0; half < 2; ++half) {
    Doubles* along = columns[half];
    std::memcpy(along, static_cast<const void*>(records + 8 * half), sizeof columns[half]);
    Transpose(along);
    alignas(64) double origin[3][8];
    for (int lane = 0; lane < 8; ++lane)
      for (int k = 0; k < 3; ++k) origin[k][lane] = cameras[records[8 * half + lane].camera].origin_mm[k];
    Doubles from_reference[3];
    for (int k = 0; k < 3; ++k) from_reference[k] = LoadDoubles(origin[k]) - reference_mm[k];
    square[half] = 1.0 / (along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
    distance[half] =
        (along[0] * from_reference[0] + along[1] * from_reference[1] + along[2] * from_reference[2]) *
        square[half];
    for (int k = 0; k < 3; ++k) foot[half][k] = from_reference[k] - along[k] * distance[half];
  }
  alignas(64) float camera_axis[3][kRayLanes], left[kRayLanes];
  for (int lane = 0; lane < kRayLanes; ++lane) {
    const RayCamera& camera = cameras[records[lane].camera];
    for (int k = 0; k < 3; ++k) camera_axis[k][lane] = camera.axis[k];
    left[lane] = camera.calibration_px2;
  }
  Lanes along_axis = {};
  for (int k = 0; k < 3; ++k) {
    constexpr float kFarAway = 1e12f;
    const Lanes axis = Load(camera_axis[k]);
    const Lanes at = has_ray ? Short(foot[0][k], foot[1][k]) : Lanes{} + kFarAway;
    along_axis += axis * at;
    Store(axis, local->axis[k]);
    Store(at, local->foot_mm[k]);
    Store(Short(columns[0][k], columns[1][k]), local->along[k]);
  }
  for (int k = 0; k < 6; ++k) {
    const IntLanes pixel =
        EveryOther(Bits<IntLanes>(columns[0][3 + k / 2]), Bits<IntLanes>(columns[1][3 + k / 2]), k % 2);
    Store(Bits<Lanes>(pixel), local->pixel_from_offset[k]);
  }
  Store(Short(square[0], square[1]), local->inverse_square);
  const Lanes depth = -Short(distance[0], distance[1]) - along_axis;
  Store(has_ray ? depth : Lanes{} + 1.0f, local->depth_mm);
  const Lanes sigma =
      Bits<Lanes>(EveryOther(Bits<IntLanes>(columns[0][6]), Bits<IntLanes>(columns[1][6]), 0));
  const Lanes used = Max(sigma, Lanes{} + limits.min_sigma_px);
  Store(1.0f / (used * used + Load(left)), local->inverse_variance);
  const float sigmas2 = limits.max_residual_sigmas * limits.max_residual_sigmas;
  Store(
      Max(sigmas2 * (sigma * sigma + Load(left)), Lanes{} + limits.min_residual_px * limits.min_residual_px),
      local->limit_px2);
}

void Localise(const RayCamera* cameras, const RayRecord* records, int rays, const double* reference_mm,
              const RayLimits& limits, LocalTile* local) {
  for (int t = 0; t * kRayLanes < rays; ++t)
    LocaliseTile(cameras, records + t * kRayLanes, Number(t * kRayLanes) < rays, reference_mm, limits,
                 &local[t]);
}

inline Lanes SquaredDistance(const LocalTile& tile, const Lanes* from_foot) {
  const Lanes u[3] = {Load(tile.along[0]), Load(tile.along[1]), Load(tile.along[2])};
  const Lanes along =
      (from_foot[0] * u[0] + from_foot[1] * u[1] + from_foot[2] * u[2]) * Load(tile.inverse_square);
  const Lanes x = from_foot[0] - u[0] * along, y = from_foot[1] - u[1] * along,
              z = from_foot[2] - u[2] * along;
  return x * x + y * y + z * z;
}

RayScore Score(const LocalTile* local, int rays, const float* point_mm, float radius_mm2, int at_least) {
  RayScore score;
  Lanes sum = {};
  for (int t = 0; t * kRayLanes < rays; ++t) {
    Lanes from_foot[3];
    for (int k = 0; k < 3; ++k) from_foot[k] = point_mm[k] - Load(local[t].foot_mm[k]);
    const Lanes square = SquaredDistance(local[t], from_foot);
    const Lanes near = square <= radius_mm2 ? Lanes{} + 1.0f : Lanes{};
    score.rays += static_cast<int>(SumLanes(near));
    sum += near * square;
    if (score.rays + rays - kRayLanes * (t + 1) < at_least) break;
  }
  score.squared_mm2 = SumLanes(sum);
  return score;
}

// Huber's weights for squared residuals in units of their sigma.
inline Lanes HuberWeights(Lanes squared_sigmas, float huber_sigmas) {
  const IntLanes beyond = squared_sigmas > huber_sigmas * huber_sigmas;
  Lanes weight = Lanes{} + 1.0f;
  if (!Any(beyond)) return weight;
  for (int lane = 0; lane < kRayLanes; ++lane)
    if (beyond[lane]) weight[lane] = huber_sigmas / __builtin_sqrtf(squared_sigmas[lane]);
  return weight;
}

struct SystemSums {
  Lanes matrix[6] = {}, gradient[3] = {}, chi_square = {};
  IntLanes behind = {};
};

inline void LineariseTile(LocalTile* local, const float* point_mm, const RayLimits& limits,
                          bool select_by_radius, SystemSums* sums) {
  Lanes from_foot[3], axis[3];
  Lanes depth = Load(local->depth_mm);
  for (int k = 0; k < 3; ++k) {
    from_foot[k] = point_mm[k] - Load(local->foot_mm[k]);
    axis[k] = Load(local->axis[k]);
    depth += axis[k] * point_mm[k];
  }
  const Lanes inverse_depth = 1.0f / depth;
  // Rows of the Jacobian and residuals. The pixel of a point on the ray is that of the observation.
  Lanes jacobian[2][3], residual[2];
  for (int row = 0; row < 2; ++row) {
    Lanes a[3];
    for (int k = 0; k < 3; ++k) a[k] = Load(local->pixel_from_offset[3 * row + k]);
    residual[row] = (a[0] * from_foot[0] + a[1] * from_foot[1] + a[2] * from_foot[2]) * inverse_depth;
    for (int k = 0; k < 3; ++k) jacobian[row][k] = (a[k] - residual[row] * axis[k]) * inverse_depth;
  }
  const Lanes residual2 = residual[0] * residual[0] + residual[1] * residual[1];
  const IntLanes in_front = depth > 0.0f;
  const IntLanes near = (SquaredDistance(*local, from_foot) <= limits.radius_mm2) & in_front;
  const Lanes inlier = (near & (residual2 <= Load(local->limit_px2))) ? Lanes{} + 1.0f : Lanes{};
  if (select_by_radius) Store(near ? Lanes{} + 1.0f : Lanes{}, local->member);
  const Lanes member = Load(local->member);
  Store(inlier, local->inlier);
  Store(residual2, local->residual_px2);
  sums->behind |= ~in_front & (member > 0.0f);

  const Lanes inverse_variance = member * Load(local->inverse_variance);
  const Lanes squared_sigmas = residual2 * inverse_variance;
  const Lanes weight = HuberWeights(squared_sigmas, limits.huber_sigmas) * inverse_variance;
  sums->chi_square += squared_sigmas;
  int entry = 0;
  for (int i = 0; i < 3; ++i) {
    const Lanes x = weight * jacobian[0][i], y = weight * jacobian[1][i];
    for (int j = i; j < 3; ++j) sums->matrix[entry++] += x * jacobian[0][j] + y * jacobian[1][j];
    sums->gradient[i] += x * residual[0] + y * residual[1];
  }
}

void Linearise(LocalTile* local, int rays, const float* point_mm, const RayLimits& limits,
               bool select_by_radius, RaySystem* system) {
  SystemSums sums;
  for (int t = 0; t * kRayLanes < rays; ++t)
    LineariseTile(&local[t], point_mm, limits, select_by_radius, &sums);
  for (int k = 0; k < 6; ++k) system->matrix[k] = SumLanes(sums.matrix[k]);
  for (int k = 0; k < 3; ++k) system->gradient[k] = SumLanes(sums.gradient[k]);
  system->chi_square = SumLanes(sums.chi_square);
  system->in_front = !Any(sums.behind);
}

}  // namespace

extern const RayKernels kRayKernels;
const RayKernels kRayKernels = {Unproject, Localise, Score, Linearise};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
