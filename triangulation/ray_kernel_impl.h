// Body of the ray kernels; see simd/lanes.h. A group of 16 nodes is taken in parts of kLanes.
#include "simd/lanes.h"
#include "triangulation/ray_kernel.h"
#include "triangulation/ray_rows_impl.h"
#include "triangulation/ray_solution_impl.h"

namespace weft::WEFT_KERNEL_NAMESPACE {
namespace {

inline Lanes Min(Lanes a, Lanes b) { return a < b ? a : b; }
inline Lanes Ones(IntLanes mask) { return mask ? Lanes{} + 1.0f : Lanes{}; }
constexpr float kFarAway = 1e30f;

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
  const Lanes x = Load(row.pixel[0] + first) + Load(row.to_ray[0] + first);
  const Lanes y = Load(row.pixel[1] + first) + Load(row.to_ray[1] + first);
  const Lanes off_x = at[0] - x * at[2], off_y = at[1] - y * at[2], along = off_x * x + off_y * y;
  const Lanes square = off_x * off_x + off_y * off_y - along * along / (1.0f + (x * x + y * y));
  return at[2] > 0.0f ? square : Lanes{} + __builtin_nanf("");
}

void Score(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points, float radius_mm2,
           const float* enough, GroupScore* score) {
  constexpr int kRowsBetweenLooks = 8;
  for (int first = 0; first < kNodeLanes; first += kLanes) {
    const NearPoints near_anchor = NearAnchor(points, first);
    const Lanes enough_cameras = Load(enough + first);
    Lanes seeing = {}, sum = {}, closest = {};
    for (int i = 0; i < count; ++i) {
      if (i % kRowsBetweenLooks == 0 && !Any(seeing < enough_cameras)) break;
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

// The anchor before a camera. Its numbers are large, so their differences are taken in doubles.
struct Anchor {
  Anchor(const RayCamera& of, const RayPoints& points) : camera(of) {
    double at[3], anchor_mm[3];
    for (int k = 0; k < 3; ++k) anchor_mm[k] = points.mm[k][points.anchor];
    const double* r = camera.rotation;
    for (int k = 0; k < 3; ++k)
      at[k] = r[3 * k] * anchor_mm[0] + r[3 * k + 1] * anchor_mm[1] + r[3 * k + 2] * anchor_mm[2] +
              camera.translation_mm[k];
    constexpr double kLeastDepthMm = 1;
    const double inverse = at[2] > kLeastDepthMm ? 1 / at[2] : 0;
    depth = static_cast<float>(at[2]);
    inverse_depth = static_cast<float>(inverse);
    for (int k = 0; k < 2; ++k) {
      const double exact_plane = at[k] * inverse;
      plane[k] = static_cast<float>(exact_plane);
      plane_rest[k] = static_cast<float>(exact_plane - plane[k]);
      rest[k] = static_cast<float>(at[k] - exact_plane * at[2]);
    }
  }

  const RayCamera& camera;
  float depth;
  float inverse_depth;  // 0 where it is not in front
  float plane[2];       // on the plane z = 1
  float plane_rest[2];  // what the float lacks
  float rest[2];        // of the position; 0 where it is in front
};

// Points in front of a camera, beside their rays.
struct Seen {
  IntLanes valid;  // in front of it, and there is a ray
  Lanes inverse_depth;
  Lanes plane[2];        // on the plane z = 1; of the anchor where not valid
  Lanes residual_px[2];  // 0 where not valid
};

inline Seen See(const Anchor& anchor, const RayRow& row, int first, const NearPoints& points) {
  const float* r = anchor.camera.rough.rotation;
  const Lanes* d = points.from_anchor_mm;
  const auto turned = [&](int k) { return r[3 * k] * d[0] + r[3 * k + 1] * d[1] + r[3 * k + 2] * d[2]; };
  const Lanes deeper = turned(2);
  Seen seen;
  constexpr float kLeastDepthMm = 1e-3f;
  const Lanes depth = anchor.depth + deeper;
  const Lanes to_ray = Load(row.to_ray[0] + first);
  seen.valid = (depth > kLeastDepthMm) & (to_ray == to_ray);
  seen.inverse_depth = seen.valid ? 1.0f / depth : Lanes{};
  Lanes from_ray[2];
  for (int k = 0; k < 2; ++k) {
    const Lanes from_anchor = (turned(k) - anchor.plane[k] * deeper + anchor.rest[k]) * seen.inverse_depth;
    seen.plane[k] = anchor.plane[k] + from_anchor;
    const Lanes from_pixel =
        (anchor.plane[k] - Load(row.pixel[k] + first)) + (from_anchor + anchor.plane_rest[k]);
    from_ray[k] = seen.valid ? from_pixel - Load(row.to_ray[k] + first) : Lanes{};
  }
  const RayCamera::Floats& camera = anchor.camera.rough;
  const Lanes xy = Load(row.lens[1] + first);
  seen.residual_px[0] = camera.fx_px * (Load(row.lens[0] + first) * from_ray[0] + xy * from_ray[1]);
  seen.residual_px[1] = camera.fy_px * (xy * from_ray[0] + Load(row.lens[2] + first) * from_ray[1]);
  return seen;
}

// A row where it was linearised.
struct RowLanes {
  Lanes jacobian[2][3], residual_px[2];
  Lanes inverse_variance;
  Lanes near;       // 1 for a ray within the radius
  IntLanes checks;  // whether one within the residual limit may still be beyond the radius
};

// The squared distance of point and ray by their residual: that of the smallest step that takes it away. A
// form over a determinant; neither is divided here, since comparisons take a third of the time.
struct DistanceForm {
  explicit DistanceForm(const Lanes (*jacobian)[3]) {
    for (int k = 0; k < 3; ++k) {
      xx += jacobian[1][k] * jacobian[1][k];
      xy -= jacobian[0][k] * jacobian[1][k];
      yy += jacobian[0][k] * jacobian[0][k];
    }
    determinant = xx * yy - xy * xy;
  }
  IntLanes IsWithin(float radius_mm2, Lanes x, Lanes y) const {
    return (determinant > 0.0f) & (xx * x * x + 2.0f * xy * x * y + yy * y * y <= radius_mm2 * determinant);
  }
  // Whether all residuals of that length are; on the safe side, as eigenvalues are below their sum.
  IntLanes AreAllWithin(float radius_mm2, Lanes limit_px2) const {
    constexpr float kMargin = 0.999f;
    return (xx + yy) * limit_px2 < kMargin * radius_mm2 * determinant;
  }

  Lanes xx = {}, xy = {}, yy = {}, determinant;
};

__attribute__((always_inline)) inline RowLanes LineariseRow(const Anchor& anchor, const RayRow& row,
                                                            int first, const NearPoints& points,
                                                            const RayLimits& limits, LinearRow* out) {
  RowLanes lanes;
  const RayCamera& camera = anchor.camera;
  const Seen seen = See(anchor, row, first, points);
  const float* r = camera.rough.rotation;
  const Lanes of_x = camera.rough.fx_px * seen.inverse_depth, of_y = camera.rough.fy_px * seen.inverse_depth;
  const Lanes xy = Load(row.lens[1] + first);
  const Lanes pixel[2][2] = {{of_x * Load(row.lens[0] + first), of_x * xy},
                             {of_y * xy, of_y * Load(row.lens[2] + first)}};
  for (int k = 0; k < 3; ++k) {
    const Lanes of_plane[2] = {r[k] - r[6 + k] * seen.plane[0], r[3 + k] - r[6 + k] * seen.plane[1]};
    for (int i = 0; i < 2; ++i) {
      lanes.jacobian[i][k] = pixel[i][0] * of_plane[0] + pixel[i][1] * of_plane[1];
      Store(lanes.jacobian[i][k], out->jacobian[i][k] + first);
    }
  }
  for (int i = 0; i < 2; ++i) {
    lanes.residual_px[i] = seen.residual_px[i];
    Store(seen.residual_px[i], out->residual_px[i] + first);
  }
  for (int k = 0; k < 3; ++k) out->axis[k] = r[6 + k] * anchor.inverse_depth;
  const Lanes sigma = Load(row.sigma_px + first), used = Max(sigma, limits.min_sigma_px);
  lanes.inverse_variance = seen.valid ? 1.0f / (used * used + camera.calibration_px2) : Lanes{};
  Store(lanes.inverse_variance, out->inverse_variance + first);
  const float sigmas2 = limits.max_residual_sigmas * limits.max_residual_sigmas;
  const Lanes limit_px2 = Max(sigmas2 * (sigma * sigma + camera.calibration_px2),
                              limits.min_residual_px * limits.min_residual_px);
  Store(seen.valid ? limit_px2 : Lanes{} - 1.0f, out->limit_px2 + first);

  const DistanceForm form(lanes.jacobian);
  lanes.near = Ones(seen.valid & form.IsWithin(limits.radius_mm2, seen.residual_px[0], seen.residual_px[1]));
  lanes.checks = seen.valid & ~form.AreAllWithin(limits.radius_mm2, limit_px2);
  return lanes;
}

bool Linearise(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points,
               const RayLimits& limits, LinearRow* linear) {
  IntLanes checks = {};
  for (int first = 0; first < kNodeLanes; first += kLanes) {
    const NearPoints near_anchor = NearAnchor(points, first);
    for (int i = 0; i < count; ++i) {
      const Anchor anchor(cameras[rows[i].camera], points);
      const RowLanes row = LineariseRow(anchor, rows[i], first, near_anchor, limits, &linear[i]);
      Store(row.near, linear[i].inlier + first);
      const IntLanes takes_part = Load(linear[i].weight + first) > 0.0f;
      Store(takes_part ? row.inverse_variance : Lanes{}, linear[i].weight + first);
      checks |= row.checks;
    }
  }
  return Any(checks);
}

struct SystemSums {
  Lanes matrix[6] = {}, surplus[6] = {}, gradient[3] = {}, chi_square = {}, inliers = {};
  IntLanes changed = {};
};

// `force`: the ray's gradient.
inline void AddToSystem(const Lanes (*jacobian)[3], const Lanes* residual, Lanes weight, SystemSums* sums,
                        Lanes* force) {
  int entry = 0;
  for (int i = 0; i < 3; ++i) {
    const Lanes x = weight * jacobian[0][i], y = weight * jacobian[1][i];
    for (int j = i; j < 3; ++j) sums->matrix[entry++] += x * jacobian[0][j] + y * jacobian[1][j];
    force[i] = x * residual[0] + y * residual[1];
    sums->gradient[i] += force[i];
  }
}

inline void AccumulateRow(LinearRow* row, int first, const Lanes* step, const RayLimits& limits,
                          SystemSums* sums) {
  const Lanes deeper = row->axis[0] * step[0] + row->axis[1] * step[1] + row->axis[2] * step[2];
  const Lanes smaller = 1.0f - deeper + deeper * deeper;  // 1 / (1 + deeper)
  Lanes jacobian[2][3], residual[2];
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 3; ++k) jacobian[i][k] = Load(row->jacobian[i][k] + first);
    residual[i] = Load(row->residual_px[i] + first) +
                  (jacobian[i][0] * step[0] + jacobian[i][1] * step[1] + jacobian[i][2] * step[2]) * smaller;
  }
  const Lanes residual2 = residual[0] * residual[0] + residual[1] * residual[1];
  IntLanes near = residual2 <= Load(row->limit_px2 + first);
  if (limits.checks_distance)
    near &= DistanceForm(jacobian).IsWithin(limits.radius_mm2, residual[0], residual[1]);
  const Lanes inlier = Ones(near), weight = Load(row->weight + first);
  Store(inlier, row->inlier + first);
  sums->inliers += inlier;
  sums->changed |= near ^ (weight > 0.0f);

  const Lanes squared_sigmas = residual2 * weight;
  sums->chi_square += squared_sigmas;
  const float bound = limits.huber_sigmas * limits.huber_sigmas;
  const IntLanes is_beyond = squared_sigmas > bound;
  Lanes force[3];
  if (!Any(is_beyond)) return AddToSystem(jacobian, residual, weight, sums, force);
  // Huber's weight: 1, or the bound over the residual beyond it.
  const Lanes huber = Sqrt(bound / Max(squared_sigmas, bound));
  AddToSystem(jacobian, residual, weight * huber, sums, force);
  const Lanes along_residual = is_beyond ? huber * (1.0f / bound) : Lanes{};
  int entry = 0;
  for (int i = 0; i < 3; ++i) {
    const Lanes part = along_residual * force[i];
    for (int j = i; j < 3; ++j) sums->surplus[entry++] += part * force[j];
  }
}

inline void StoreSystem(const SystemSums& sums, int first, GroupSystem* system) {
  for (int k = 0; k < 6; ++k) Store(sums.matrix[k], system->matrix[k] + first);
  for (int k = 0; k < 6; ++k) Store(sums.surplus[k], system->surplus[k] + first);
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

bool Start(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points,
           const RayLimits& limits, LinearRow* linear, GroupSystem* system) {
  constexpr int kParts = kNodeLanes / kLanes;
  IntLanes checks = {};
  NearPoints near_anchor[kParts];
  for (int part = 0; part < kParts; ++part) near_anchor[part] = NearAnchor(points, part * kLanes);
  SystemSums sums[kParts];
  for (int i = 0; i < count; ++i) {
    Fetch(rows[i].ahead);
    const Anchor anchor(cameras[rows[i].camera], points);
    for (int part = 0; part < kParts; ++part) {
      const int first = part * kLanes;
      const RowLanes row = LineariseRow(anchor, rows[i], first, near_anchor[part], limits, &linear[i]);
      const Lanes weight = row.near * row.inverse_variance, *residual = row.residual_px;
      Store(weight, linear[i].weight + first);
      sums[part].chi_square += (residual[0] * residual[0] + residual[1] * residual[1]) * weight;
      Lanes force[3];
      AddToSystem(row.jacobian, residual, weight, &sums[part], force);
      checks |= row.checks;
    }
  }
  for (int part = 0; part < kParts; ++part) StoreSystem(sums[part], part * kLanes, system);
  return Any(checks);
}

void Accumulate(LinearRow* rows, int count, const RaySteps& steps, const RayLimits& limits,
                GroupSystem* system) {
  for (int first = 0; first < kNodeLanes; first += kLanes) {
    if (!Any(LoadAs<IntLanes>(steps.wanted + first))) continue;
    const Lanes step[3] = {Load(steps.mm[0] + first), Load(steps.mm[1] + first), Load(steps.mm[2] + first)};
    SystemSums sums;
    for (int i = 0; i < count; ++i) AccumulateRow(&rows[i], first, step, limits, &sums);
    StoreSystem(sums, first, system);
  }
}

}  // namespace

extern const RayKernels kRayKernels;
const RayKernels kRayKernels = {Read, Undistort, Score, Linearise, Start, Accumulate, Solve};

}  // namespace weft::WEFT_KERNEL_NAMESPACE
