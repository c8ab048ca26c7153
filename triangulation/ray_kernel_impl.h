// Body of the ray kernels; see pattern/kernel_lanes.h. A tile of 16 rays is taken in parts of kLanes.
#include <cstddef>

#include "pattern/kernel_lanes.h"
#include "triangulation/ray_kernel.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

constexpr int kParts = kRayLanes / kLanes;
constexpr int kHalf = kLanes / 2;
typedef float HalfLanes __attribute__((vector_size(4 * kHalf)));
typedef double Doubles __attribute__((vector_size(8 * kHalf)));

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
inline Lanes4 FoldParts(const Lanes* v) {
  const HalfLanes a = HalfOf(v[0], 0) + HalfOf(v[0], 1);
  return __builtin_shufflevector(a, a, 0, 1, 2, 3) + __builtin_shufflevector(a, a, 4, 5, 6, 7);
}
#elif defined(__AVX2__)
inline Lanes Join(HalfLanes a, HalfLanes b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7); }
inline HalfLanes HalfOf(Lanes v, int half) {
  return half == 0 ? __builtin_shufflevector(v, v, 0, 1, 2, 3) : __builtin_shufflevector(v, v, 4, 5, 6, 7);
}
inline Lanes4 FoldParts(const Lanes* v) {
  const Lanes a = v[0] + v[1];
  return HalfOf(a, 0) + HalfOf(a, 1);
}
#else
inline Lanes Join(HalfLanes a, HalfLanes b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3); }
inline HalfLanes HalfOf(Lanes v, int half) {
  return half == 0 ? __builtin_shufflevector(v, v, 0, 1) : __builtin_shufflevector(v, v, 2, 3);
}
inline Lanes4 FoldParts(const Lanes* v) { return (v[0] + v[2]) + (v[1] + v[3]); }
#endif

inline Lanes Short(const Doubles* halves) {
  return Join(__builtin_convertvector(halves[0], HalfLanes), __builtin_convertvector(halves[1], HalfLanes));
}
inline Doubles Long(Lanes v, int half) { return __builtin_convertvector(HalfOf(v, half), Doubles); }
inline Lanes Abs(Lanes v) { return v < 0.0f ? -v : v; }
inline Lanes Max(Lanes a, Lanes b) { return a > b ? a : b; }

// Sum over the 16 lanes of a tile, in the same order for any number of parts.
inline float SumParts(const Lanes* v) {
  const Lanes4 b = FoldParts(v);
  return (b[0] + b[2]) + (b[1] + b[3]);
}
// Whether a comparison holds in any lane.
inline bool Any(IntLanes mask) {
  typedef int64_t Pairs __attribute__((vector_size(4 * kLanes)));
  const Pairs v = (Pairs)mask;
  int64_t any = 0;
  for (int k = 0; k < kHalf; ++k) any |= v[k];
  return any != 0;
}
// The numbers of the lanes from `first` on.
inline IntLanes Number(int first) {
  constexpr int32_t kNumbers[kRayLanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return LoadAs<IntLanes>(kNumbers) + first;
}

// Records of kLanes rays or cameras, by place in the record; numbers of 8 bytes take two places.
constexpr int kPlaces = sizeof(RayRecord) / 4;
struct Places {
  IntLanes at[kPlaces];

  Lanes Floats(int place) const { return (Lanes)at[place]; }
  Doubles Wide(int place, int half) const { return (Doubles)ByTurns(at[place], at[place + 1], half); }
  void Set(int place, Lanes v) { at[place] = (IntLanes)v; }
  void SetWide(int place, const Doubles* halves) {
    for (int odd = 0; odd < 2; ++odd)
      at[place + odd] = EveryOther((IntLanes)halves[0], (IntLanes)halves[1], odd);
  }
};
constexpr int kAlong = 0, kPixelFromOffset = 6, kSigma = 12, kCamera = 13, kValid = 14, kSpare = 15;
constexpr int kOrigin = 0, kAxis = 6, kCalibration = 9;
static_assert(offsetof(RayRecord, pixel_from_offset) == 4 * kPixelFromOffset &&
              offsetof(RayRecord, sigma_px) == 4 * kSigma && offsetof(RayRecord, camera) == 4 * kCamera &&
              offsetof(RayRecord, valid) == 4 * kValid && offsetof(RayRecord, spare) == 4 * kSpare &&
              offsetof(RayCamera, axis) == 4 * kAxis &&
              offsetof(RayCamera, calibration_px2) == 4 * kCalibration);

// `to`: kLanes records.
void WriteRecords(Places places, RayRecord* const* to, int count) {
  for (int first = 0; first < kPlaces; first += kLanes) {
    Transpose(places.at + first);
    for (int lane = 0; lane < kLanes; ++lane)
      if (lane < count)
        std::memcpy(reinterpret_cast<char*>(to[lane]) + 4 * first, &places.at[first + lane], 4 * kLanes);
  }
}

template <typename Record>
Places ReadRecords(const Record* const* from) {
  Places places;
  for (int first = 0; first < kPlaces; first += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane)
      places.at[first + lane] = LoadAs<IntLanes>(reinterpret_cast<const char*>(from[lane]) + 4 * first);
    Transpose(places.at + first);
  }
  return places;
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

// A part of a tile on the way from pixels to rays.
struct Unprojection {
  Doubles goal[2][2];  // [axis][half]
  Lanes goal_x, goal_y, x, y, off_x, off_y;
  Lanes xx, xy, yy, determinant;  // of the Jacobian; the inverse determinant

  void Start(const RayCamera& camera, const double* x_px, const double* y_px) {
    for (int half = 0; half < 2; ++half) {
      goal[0][half] = (LoadDoubles(x_px + kHalf * half) - camera.cx_px) / camera.fx_px;
      goal[1][half] = (LoadDoubles(y_px + kHalf * half) - camera.cy_px) / camera.fy_px;
    }
    x = goal_x = Short(goal[0]);
    y = goal_y = Short(goal[1]);
  }

  // False where all lanes are within the tolerance.
  bool Look(const float* lens, float tolerance) {
    Lanes seen_x, seen_y, radial, slope;
    Distort<Lanes, float>(lens, x, y, &seen_x, &seen_y, &radial, &slope);
    xx = radial + 2.0f * x * x * slope + 2.0f * lens[2] * y + 6.0f * lens[3] * x;
    xy = 2.0f * x * y * slope + 2.0f * lens[2] * x + 2.0f * lens[3] * y;
    yy = radial + 2.0f * y * y * slope + 6.0f * lens[2] * y + 2.0f * lens[3] * x;
    determinant = 1.0f / (xx * yy - xy * xy);
    off_x = seen_x - goal_x;
    off_y = seen_y - goal_y;
    return Any((Abs(off_x) + Abs(off_y)) > tolerance);
  }

  void Step() {
    x -= (yy * off_x - xy * off_y) * determinant;
    y -= (xx * off_y - xy * off_x) * determinant;
  }

  // One step in doubles with the last Jacobian, and the rays there.
  Places Finish(const RayCamera& camera, float tolerance) {
    Doubles long_x[2], long_y[2], long_off_x[2], long_off_y[2];
    for (int half = 0; half < 2; ++half) {
      long_x[half] = Long(x, half);
      long_y[half] = Long(y, half);
      Doubles at_x, at_y, unused;
      Distort<Doubles, double>(camera.distortion, long_x[half], long_y[half], &at_x, &at_y, &unused, nullptr);
      long_off_x[half] = at_x - goal[0][half];
      long_off_y[half] = at_y - goal[1][half];
    }
    off_x = Short(long_off_x);
    off_y = Short(long_off_y);
    const Lanes exact_x = (yy * off_x - xy * off_y) * determinant,
                exact_y = (xx * off_y - xy * off_x) * determinant;
    const double* r = camera.rotation;
    Places out;
    Doubles along[3][2];
    for (int half = 0; half < 2; ++half) {
      long_x[half] -= Long(exact_x, half);
      long_y[half] -= Long(exact_y, half);
      for (int k = 0; k < 3; ++k) along[k][half] = r[k] * long_x[half] + r[3 + k] * long_y[half] + r[6 + k];
    }
    for (int k = 0; k < 3; ++k) out.SetWide(kAlong + 2 * k, along[k]);
    const float fx = static_cast<float>(camera.fx_px), fy = static_cast<float>(camera.fy_px);
    const Lanes pixel[2][2] = {{fx * xx, fx * xy}, {fy * xy, fy * yy}};
    for (int row = 0; row < 2; ++row) {
      const Lanes depth = pixel[row][0] * x + pixel[row][1] * y;
      for (int k = 0; k < 3; ++k)
        out.Set(kPixelFromOffset + 3 * row + k, pixel[row][0] * static_cast<float>(r[k]) +
                                                    pixel[row][1] * static_cast<float>(r[3 + k]) -
                                                    depth * static_cast<float>(r[6 + k]));
    }
    out.at[kValid] = ((Abs(off_x) + Abs(off_y)) < 2 * tolerance) &
                     ((x * x + y * y) < static_cast<float>(camera.safe_square)) & (Abs(determinant) < 1e6f);
    return out;
  }
};

// Newton's method in floats, then one step in doubles. All parts go on until each is done: the bytes must
// not depend on their number.
void UnprojectGroup(const RayCamera& camera, int camera_number, const float* lens, int first, int count,
                    RayColumns* columns) {
  constexpr int kMaxIterations = 8;
  constexpr float kFloatTolerance = 1e-6f;
  Unprojection parts[kParts];
  for (int p = 0; p < kParts; ++p)
    parts[p].Start(camera, columns->x_px + first + kLanes * p, columns->y_px + first + kLanes * p);
  for (int i = 0;; ++i) {
    bool any = false;
    for (Unprojection& part : parts) any |= part.Look(lens, kFloatTolerance);
    if (i == kMaxIterations || !any) break;
    for (Unprojection& part : parts) part.Step();
  }
  for (int p = 0; p < kParts; ++p) {
    const int at = first + kLanes * p;
    Places places = parts[p].Finish(camera, kFloatTolerance);
    places.Set(kSigma, Load(columns->sigma_px + at));
    places.at[kCamera] = IntLanes{} + camera_number;
    places.at[kSpare] = IntLanes{};
    StoreInts(places.at[kValid], columns->valid + at);
    WriteRecords(places, columns->record + at, count - at);
  }
}

void Unproject(const RayCamera* cameras, int camera, int count, RayColumns* columns) {
  float lens[8];
  for (int k = 0; k < 8; ++k) lens[k] = static_cast<float>(cameras[camera].distortion[k]);
  for (int first = 0; first < count; first += kRayLanes)
    UnprojectGroup(cameras[camera], camera, lens, first, count, columns);
}

void LocalisePart(const Places& cameras, const Places& rays, int first, IntLanes has_ray,
                  const double* reference_mm, const RayLimits& limits, LocalTile* local) {
  Doubles along[3][2], foot[3][2], square[2], distance[2];
  for (int half = 0; half < 2; ++half) {
    Doubles u[3], from_reference[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = along[k][half] = rays.Wide(kAlong + 2 * k, half);
      from_reference[k] = cameras.Wide(kOrigin + 2 * k, half) - reference_mm[k];
    }
    square[half] = 1.0 / (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    distance[half] =
        (u[0] * from_reference[0] + u[1] * from_reference[1] + u[2] * from_reference[2]) * square[half];
    for (int k = 0; k < 3; ++k) foot[k][half] = from_reference[k] - u[k] * distance[half];
  }
  Lanes along_axis = {};
  for (int k = 0; k < 3; ++k) {
    constexpr float kFarAway = 1e12f;
    const Lanes axis = cameras.Floats(kAxis + k);
    const Lanes at = has_ray ? Short(foot[k]) : Lanes{} + kFarAway;
    along_axis += axis * at;
    Store(axis, local->axis[k] + first);
    Store(at, local->foot_mm[k] + first);
    Store(Short(along[k]), local->along[k] + first);
  }
  Store(Short(square), local->inverse_square + first);
  const Lanes depth = -Short(distance) - along_axis;
  Store(has_ray ? depth : Lanes{} + 1.0f, local->depth_mm + first);
  const Lanes sigma = rays.Floats(kSigma), left = cameras.Floats(kCalibration);
  const Lanes used = Max(sigma, Lanes{} + limits.min_sigma_px);
  Store(1.0f / (used * used + left), local->inverse_variance + first);
  const float sigmas2 = limits.max_residual_sigmas * limits.max_residual_sigmas;
  Store(Max(sigmas2 * (sigma * sigma + left), Lanes{} + limits.min_residual_px * limits.min_residual_px),
        local->limit_px2 + first);
  for (int k = 0; k < 6; ++k) Store(rays.Floats(kPixelFromOffset + k), local->pixel_from_offset[k] + first);
}

void Localise(const RayCamera* cameras, const RayRecord* records, int rays, const double* reference_mm,
              const RayLimits& limits, LocalTile* local) {
  for (int t = 0; t * kRayLanes < rays; ++t) {
    for (int first = 0; first < kRayLanes; first += kLanes) {
      const RayRecord* from[kLanes];
      const RayCamera* seen_by[kLanes];
      for (int lane = 0; lane < kLanes; ++lane) {
        from[lane] = records + t * kRayLanes + first + lane;
        seen_by[lane] = cameras + from[lane]->camera;
      }
      LocalisePart(ReadRecords(seen_by), ReadRecords(from), first, Number(t * kRayLanes + first) < rays,
                   reference_mm, limits, &local[t]);
    }
  }
}

// Of the part that begins at lane `first`.
inline Lanes SquaredDistance(const LocalTile& tile, int first, const Lanes* from_foot) {
  const Lanes u[3] = {Load(tile.along[0] + first), Load(tile.along[1] + first), Load(tile.along[2] + first)};
  const Lanes along =
      (from_foot[0] * u[0] + from_foot[1] * u[1] + from_foot[2] * u[2]) * Load(tile.inverse_square + first);
  const Lanes x = from_foot[0] - u[0] * along, y = from_foot[1] - u[1] * along,
              z = from_foot[2] - u[2] * along;
  return x * x + y * y + z * z;
}

RayScore Score(const LocalTile* local, int rays, const float* point_mm, float radius_mm2, int at_least) {
  RayScore score;
  Lanes sum[kParts] = {};
  for (int t = 0; t * kRayLanes < rays; ++t) {
    Lanes near[kParts];
    for (int p = 0; p < kParts; ++p) {
      Lanes from_foot[3];
      for (int k = 0; k < 3; ++k) from_foot[k] = point_mm[k] - Load(local[t].foot_mm[k] + kLanes * p);
      const Lanes square = SquaredDistance(local[t], kLanes * p, from_foot);
      near[p] = square <= radius_mm2 ? Lanes{} + 1.0f : Lanes{};
      sum[p] += near[p] * square;
    }
    score.rays += static_cast<int>(SumParts(near));
    if (score.rays + rays - kRayLanes * (t + 1) < at_least) break;
  }
  score.squared_mm2 = SumParts(sum);
  return score;
}

// Huber's weights for squared residuals in units of their sigma.
inline Lanes HuberWeights(Lanes squared_sigmas, float huber_sigmas) {
  const IntLanes beyond = squared_sigmas > huber_sigmas * huber_sigmas;
  Lanes weight = Lanes{} + 1.0f;
  if (!Any(beyond)) return weight;
  for (int lane = 0; lane < kLanes; ++lane)
    if (beyond[lane]) weight[lane] = huber_sigmas / __builtin_sqrtf(squared_sigmas[lane]);
  return weight;
}

struct SystemSums {
  Lanes matrix[6] = {}, gradient[3] = {}, chi_square = {};
  IntLanes behind = {};
};

inline void LinearisePart(LocalTile* local, int first, const float* point_mm, const RayLimits& limits,
                          bool select_by_radius, SystemSums* sums) {
  Lanes from_foot[3], axis[3];
  Lanes depth = Load(local->depth_mm + first);
  for (int k = 0; k < 3; ++k) {
    from_foot[k] = point_mm[k] - Load(local->foot_mm[k] + first);
    axis[k] = Load(local->axis[k] + first);
    depth += axis[k] * point_mm[k];
  }
  const Lanes inverse_depth = 1.0f / depth;
  // Rows of the Jacobian and residuals. The pixel of a point on the ray is that of the observation.
  Lanes jacobian[2][3], residual[2];
  for (int row = 0; row < 2; ++row) {
    Lanes a[3];
    for (int k = 0; k < 3; ++k) a[k] = Load(local->pixel_from_offset[3 * row + k] + first);
    residual[row] = (a[0] * from_foot[0] + a[1] * from_foot[1] + a[2] * from_foot[2]) * inverse_depth;
    for (int k = 0; k < 3; ++k) jacobian[row][k] = (a[k] - residual[row] * axis[k]) * inverse_depth;
  }
  const Lanes residual2 = residual[0] * residual[0] + residual[1] * residual[1];
  const IntLanes in_front = depth > 0.0f;
  const IntLanes near = (SquaredDistance(*local, first, from_foot) <= limits.radius_mm2) & in_front;
  const Lanes inlier = (near & (residual2 <= Load(local->limit_px2 + first))) ? Lanes{} + 1.0f : Lanes{};
  if (select_by_radius) Store(near ? Lanes{} + 1.0f : Lanes{}, local->member + first);
  const Lanes member = Load(local->member + first);
  Store(inlier, local->inlier + first);
  Store(residual2, local->residual_px2 + first);
  sums->behind |= ~in_front & (member > 0.0f);

  const Lanes inverse_variance = member * Load(local->inverse_variance + first);
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
  constexpr int kSums = 10;
  Lanes all[kSums][kParts];
  bool behind = false;
  for (int p = 0; p < kParts; ++p) {
    SystemSums sums;
    for (int t = 0; t * kRayLanes < rays; ++t)
      LinearisePart(&local[t], kLanes * p, point_mm, limits, select_by_radius, &sums);
    for (int k = 0; k < 6; ++k) all[k][p] = sums.matrix[k];
    for (int k = 0; k < 3; ++k) all[6 + k][p] = sums.gradient[k];
    all[9][p] = sums.chi_square;
    behind |= Any(sums.behind);
  }
  for (int k = 0; k < 6; ++k) system->matrix[k] = SumParts(all[k]);
  for (int k = 0; k < 3; ++k) system->gradient[k] = SumParts(all[6 + k]);
  system->chi_square = SumParts(all[9]);
  system->in_front = !behind;
}

}  // namespace

extern const RayKernels kRayKernels;
const RayKernels kRayKernels = {Unproject, Localise, Score, Linearise};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
