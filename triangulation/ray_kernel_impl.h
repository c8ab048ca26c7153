// Body of the ray kernels; see simd/lanes.h. A group of 16 nodes is taken in parts of kLanes.
#include "simd/lanes.h"
#include "triangulation/ray_kernel.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

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
inline Doubles Long(Lanes v, int half) { return __builtin_convertvector(HalfOf(v, half), Doubles); }
inline Lanes Max(Lanes a, float b) { return a > b ? a : Lanes{} + b; }
inline Lanes Min(Lanes a, Lanes b) { return a < b ? a : b; }
inline Lanes Ones(IntLanes mask) { return mask ? Lanes{} + 1.0f : Lanes{}; }
constexpr float kFarAway = 1e30f;

// Whether a comparison holds in any lane.
inline bool Any(IntLanes mask) {
  typedef int64_t Pairs __attribute__((vector_size(4 * kLanes)));
  const Pairs v = (Pairs)mask;
  int64_t any = 0;
  for (int k = 0; k < kHalf; ++k) any |= v[k];
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

// Newton's method. A lane that is done stays as it is: the bytes must not depend on the others.
inline void UndistortRow(const RayCamera& camera, int first, RayRow* row) {
  constexpr int kMaxIterations = 10;
  constexpr float kTolerance2 = 1e-6f;  // squared step, about what remains after it
  const double center_px[2] = {camera.cx_px, camera.cy_px};
  Lanes goal[2];
  for (int k = 0; k < 2; ++k) {
    Doubles halves[2];
    for (int half = 0; half < 2; ++half)
      halves[half] =
          (LoadDoubles(row->pixel_px[k] + first + kHalf * half) - center_px[k]) * camera.inverse_focal_px[k];
    goal[k] = Short(halves);
  }
  Lanes x = goal[0], y = goal[1];
  IntLanes moving = Load(row->sigma_px + first) > 0.0f;
  const IntLanes wanted = moving;
  for (int i = 0; i < kMaxIterations && Any(moving); ++i) {
    const Lens lens = Distort(camera, x, y);
    const Lanes off_x = x + lens.shift[0] - goal[0], off_y = y + lens.shift[1] - goal[1];
    const Lanes scale = 1.0f / (lens.xx * lens.yy - lens.xy * lens.xy);
    const Lanes step_x = (lens.yy * off_x - lens.xy * off_y) * scale;
    const Lanes step_y = (lens.xx * off_y - lens.xy * off_x) * scale;
    x = moving ? x - step_x : x;
    y = moving ? y - step_y : y;
    moving &= (step_x * step_x + step_y * step_y) > kTolerance2;
  }
  const IntLanes found = wanted & ~moving & ((x * x + y * y) < camera.safe_square);
  const Lanes none = Lanes{} + __builtin_nanf("");
  Store(found ? x : none, row->plane[0] + first);
  Store(found ? y : none, row->plane[1] + first);
}

void Undistort(const RayCamera* cameras, int count, RayRow* rows) {
  for (int i = 0; i < count; ++i)
    for (int first = 0; first < kNodeLanes; first += kLanes)
      UndistortRow(cameras[rows[i].camera], first, &rows[i]);
}

// Points near each other: one of them in doubles, and from there to all.
struct NearPoints {
  double anchor_mm[3];
  Lanes from_anchor_mm[3];
};

inline NearPoints NearAnchor(const RayPoints& points, int first) {
  NearPoints near;
  for (int k = 0; k < 3; ++k) {
    near.anchor_mm[k] = points.mm[k][points.anchor];
    Doubles halves[2];
    for (int half = 0; half < 2; ++half)
      halves[half] = LoadDoubles(points.mm[k] + first + kHalf * half) - near.anchor_mm[k];
    near.from_anchor_mm[k] = Short(halves);
  }
  return near;
}

// Squared distances of points and rays; NaN where there is no ray.
inline Lanes DistanceToRow(const RayCamera& camera, const RayRow& row, int first, const NearPoints& points) {
  const float* r = camera.rough.rotation;
  Lanes from[3], at[3];
  for (int k = 0; k < 3; ++k)
    from[k] = static_cast<float>(points.anchor_mm[k] - camera.origin_mm[k]) + points.from_anchor_mm[k];
  for (int k = 0; k < 3; ++k) at[k] = r[3 * k] * from[0] + r[3 * k + 1] * from[1] + r[3 * k + 2] * from[2];
  const Lanes x = Load(row.plane[0] + first), y = Load(row.plane[1] + first);
  const Lanes off_x = at[0] - x * at[2], off_y = at[1] - y * at[2], along = off_x * x + off_y * y;
  const Lanes square = off_x * off_x + off_y * off_y - along * along / (1.0f + (x * x + y * y));
  return at[2] > 0.0f ? square : Lanes{} + __builtin_nanf("");
}

void Score(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points, float radius_mm2,
           GroupScore* score) {
  for (int first = 0; first < kNodeLanes; first += kLanes) {
    const NearPoints near_anchor = NearAnchor(points, first);
    Lanes seeing = {}, sum = {}, closest = {};
    for (int i = 0; i < count; ++i) {
      const Lanes square = DistanceToRow(cameras[rows[i].camera], rows[i], first, near_anchor);
      const Lanes counted = square <= radius_mm2 ? square : Lanes{} + kFarAway;
      closest = rows[i].repeated ? Min(closest, counted) : counted;
      if (i + 1 < count && rows[i + 1].repeated) continue;
      const IntLanes near = closest <= radius_mm2;
      seeing += Ones(near);
      sum += near ? closest : Lanes{};
    }
    Store(seeing, score->cameras + first);
    Store(sum, score->squared_mm2 + first);
  }
}

// Points in front of a camera, where it sees them.
struct Seen {
  IntLanes valid;  // in front of it, and where the lens model is one-to-one
  Lanes inverse_depth;
  Lanes plane[2];        // on the plane z = 1; 0 where not valid
  Lanes residual_px[2];  // 0 where not valid
  Lens lens;
};

// Differences of large numbers are taken in doubles: those between pixels, and all of the anchor's.
inline Seen See(const RayCamera& camera, const RayRow& row, int first, const NearPoints& points) {
  double at[3];
  const double* exact = camera.exact.rotation;
  for (int k = 0; k < 3; ++k)
    at[k] = exact[3 * k] * points.anchor_mm[0] + exact[3 * k + 1] * points.anchor_mm[1] +
            exact[3 * k + 2] * points.anchor_mm[2] + camera.translation_mm[k];
  constexpr double kLeastAnchorDepthMm = 1;
  const double inverse = at[2] > kLeastAnchorDepthMm ? 1 / at[2] : 0;
  const float* r = camera.rough.rotation;
  const Lanes* d = points.from_anchor_mm;
  const auto turned = [&](int k) { return r[3 * k] * d[0] + r[3 * k + 1] * d[1] + r[3 * k + 2] * d[2]; };
  const Lanes deeper = turned(2);
  Seen seen;
  constexpr float kLeastDepthMm = 1e-3f;
  const Lanes depth = static_cast<float>(at[2]) + deeper;
  const IntLanes in_front = depth > kLeastDepthMm;
  seen.inverse_depth = in_front ? 1.0f / depth : Lanes{};
  Lanes from_anchor[2], plane[2];
  for (int k = 0; k < 2; ++k) {
    const double anchor = at[k] * inverse;
    const float rest = static_cast<float>(at[k] - anchor * at[2]);  // 0 where the anchor is in front
    from_anchor[k] = (turned(k) - static_cast<float>(anchor) * deeper + rest) * seen.inverse_depth;
    plane[k] = static_cast<float>(anchor) + from_anchor[k];
  }
  seen.valid = in_front & ((plane[0] * plane[0] + plane[1] * plane[1]) < camera.safe_square);
  for (int k = 0; k < 2; ++k) seen.plane[k] = seen.valid ? plane[k] : Lanes{};
  seen.lens = Distort(camera, seen.plane[0], seen.plane[1]);
  const double focal_px[2] = {camera.exact.fx_px, camera.exact.fy_px};
  const double center_px[2] = {camera.cx_px, camera.cy_px};
  for (int k = 0; k < 2; ++k) {
    const double anchor_px = center_px[k] + focal_px[k] * (at[k] * inverse);
    Doubles from_pixel[2];
    for (int half = 0; half < 2; ++half)
      from_pixel[half] = anchor_px - LoadDoubles(row.pixel_px[k] + first + kHalf * half);
    const Lanes residual =
        Short(from_pixel) + static_cast<float>(focal_px[k]) * (from_anchor[k] + seen.lens.shift[k]);
    seen.residual_px[k] = seen.valid ? residual : Lanes{};
  }
  return seen;
}

__attribute__((always_inline)) inline void LineariseRow(const RayCamera& camera, const RayRow& row, int first,
                                                        const NearPoints& points, const RayLimits& limits,
                                                        LinearRow* out) {
  const Seen seen = See(camera, row, first, points);
  const float* r = camera.rough.rotation;
  const Lanes of_x = camera.rough.fx_px * seen.inverse_depth, of_y = camera.rough.fy_px * seen.inverse_depth;
  const Lanes pixel[2][2] = {{of_x * seen.lens.xx, of_x * seen.lens.xy},
                             {of_y * seen.lens.xy, of_y * seen.lens.yy}};
  Lanes jacobian[2][3];
  for (int i = 0; i < 2; ++i) {
    const Lanes depth = pixel[i][0] * seen.plane[0] + pixel[i][1] * seen.plane[1];
    for (int k = 0; k < 3; ++k) {
      jacobian[i][k] = pixel[i][0] * r[k] + pixel[i][1] * r[3 + k] - depth * r[6 + k];
      Store(jacobian[i][k], out->jacobian[i][k] + first);
    }
    Store(seen.residual_px[i], out->residual_px[i] + first);
  }
  Store(seen.inverse_depth, out->inverse_depth + first);
  for (int k = 0; k < 3; ++k) out->axis[k] = r[6 + k];
  const Lanes sigma = Load(row.sigma_px + first), used = Max(sigma, limits.min_sigma_px);
  const IntLanes has_ray = seen.valid & (sigma > 0.0f);
  Store(has_ray ? 1.0f / (used * used + camera.calibration_px2) : Lanes{}, out->inverse_variance + first);
  const float sigmas2 = limits.max_residual_sigmas * limits.max_residual_sigmas;
  const Lanes limit_px2 = Max(sigmas2 * (sigma * sigma + camera.calibration_px2),
                              limits.min_residual_px * limits.min_residual_px);
  Store(has_ray ? limit_px2 : Lanes{} - 1.0f, out->limit_px2 + first);

  // The shortest way to the ray is the smallest step that takes the residual away.
  Lanes product[3] = {};
  for (int k = 0; k < 3; ++k) {
    product[0] += jacobian[0][k] * jacobian[0][k];
    product[1] += jacobian[0][k] * jacobian[1][k];
    product[2] += jacobian[1][k] * jacobian[1][k];
  }
  const Lanes inverse = 1.0f / (product[0] * product[2] - product[1] * product[1]);
  const Lanes form[3] = {product[2] * inverse, -2.0f * product[1] * inverse, product[0] * inverse};
  for (int k = 0; k < 3; ++k) Store(form[k], out->distance_form[k] + first);
  const Lanes x = seen.residual_px[0], y = seen.residual_px[1];
  const Lanes square = form[0] * x * x + form[1] * x * y + form[2] * y * y;
  Store(Ones(has_ray & (square <= limits.radius_mm2)), out->inlier + first);
}

void Linearise(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points,
               const RayLimits& limits, LinearRow* linear) {
  for (int first = 0; first < kNodeLanes; first += kLanes) {
    const NearPoints near_anchor = NearAnchor(points, first);
    for (int i = 0; i < count; ++i)
      LineariseRow(cameras[rows[i].camera], rows[i], first, near_anchor, limits, &linear[i]);
  }
}

struct SystemSums {
  Lanes matrix[6] = {}, gradient[3] = {}, chi_square = {}, inliers = {};
  IntLanes changed = {};
};

inline void AccumulateRow(LinearRow* row, int first, const Lanes* step, const RayLimits& limits,
                          SystemSums* sums) {
  const Lanes deeper = (row->axis[0] * step[0] + row->axis[1] * step[1] + row->axis[2] * step[2]) *
                       Load(row->inverse_depth + first);
  const Lanes smaller = 1.0f - deeper + deeper * deeper;  // 1 / (1 + deeper)
  Lanes jacobian[2][3], residual[2];
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 3; ++k) jacobian[i][k] = Load(row->jacobian[i][k] + first);
    residual[i] = Load(row->residual_px[i] + first) +
                  (jacobian[i][0] * step[0] + jacobian[i][1] * step[1] + jacobian[i][2] * step[2]) * smaller;
  }
  const Lanes xx = residual[0] * residual[0], xy = residual[0] * residual[1], yy = residual[1] * residual[1];
  const Lanes residual2 = xx + yy;
  const Lanes distance2 = Load(row->distance_form[0] + first) * xx +
                          Load(row->distance_form[1] + first) * xy + Load(row->distance_form[2] + first) * yy;
  const Lanes inlier = Ones((residual2 <= Load(row->limit_px2 + first)) & (distance2 <= limits.radius_mm2));
  const Lanes member = Load(row->member + first);
  Store(inlier, row->inlier + first);
  sums->inliers += inlier;
  sums->changed |= inlier != member;

  const Lanes inverse_variance = member * Load(row->inverse_variance + first);
  const Lanes squared_sigmas = residual2 * inverse_variance;
  sums->chi_square += squared_sigmas;
  // Huber's weight.
  const float bound = limits.huber_sigmas * limits.huber_sigmas;
  const Lanes weight = inverse_variance * Sqrt(bound / Max(squared_sigmas, bound));
  int entry = 0;
  for (int i = 0; i < 3; ++i) {
    const Lanes x = weight * jacobian[0][i], y = weight * jacobian[1][i];
    for (int j = i; j < 3; ++j) sums->matrix[entry++] += x * jacobian[0][j] + y * jacobian[1][j];
    sums->gradient[i] += x * residual[0] + y * residual[1];
  }
}

inline void StoreSystem(const SystemSums& sums, int first, GroupSystem* system) {
  for (int k = 0; k < 6; ++k) Store(sums.matrix[k], system->matrix[k] + first);
  for (int k = 0; k < 3; ++k) Store(sums.gradient[k], system->gradient[k] + first);
  Store(sums.chi_square, system->chi_square + first);
  Store(sums.inliers, system->inliers + first);
  StoreInts(sums.changed, system->changed + first);
}

inline void Fetch(const void* ahead) {
  constexpr int kCacheLine = 64, kNotForLong = 2;
  for (int at = 0; at <= kBytesAhead; at += kCacheLine)
    __builtin_prefetch(static_cast<const char*>(ahead) + at, 0, kNotForLong);
}

void Start(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points,
           const RayLimits& limits, LinearRow* linear, GroupSystem* system) {
  constexpr Lanes kNoStep[3] = {};
  for (int first = 0; first < kNodeLanes; first += kLanes) {
    const NearPoints near_anchor = NearAnchor(points, first);
    SystemSums sums;
    for (int i = 0; i < count; ++i) {
      if (first == 0) Fetch(rows[i].ahead);
      LineariseRow(cameras[rows[i].camera], rows[i], first, near_anchor, limits, &linear[i]);
      Store(Load(linear[i].inlier + first), linear[i].member + first);
      AccumulateRow(&linear[i], first, kNoStep, limits, &sums);
    }
    StoreSystem(sums, first, system);
  }
}

void Accumulate(LinearRow* rows, int count, const float (*step_mm)[kNodeLanes], const RayLimits& limits,
                GroupSystem* system) {
  for (int first = 0; first < kNodeLanes; first += kLanes) {
    const Lanes step[3] = {Load(step_mm[0] + first), Load(step_mm[1] + first), Load(step_mm[2] + first)};
    SystemSums sums;
    for (int i = 0; i < count; ++i) AccumulateRow(&rows[i], first, step, limits, &sums);
    StoreSystem(sums, first, system);
  }
}

}  // namespace

extern const RayKernels kRayKernels;
const RayKernels kRayKernels = {Undistort, Score, Linearise, Start, Accumulate};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
