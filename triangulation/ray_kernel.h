// The inner loops of triangulation, compiled for several instruction sets. All give the same bytes.
#pragma once

#include <cstdint>

namespace weft {

inline constexpr int kRayLanes = 16;

// A camera as the kernels need it. distortion holds k1 k2 p1 p2 k3 k4 k5 k6, rotation is camera_from_world,
// row by row. The first cache line is what a ray needs of its camera.
struct alignas(64) RayCamera {
  double origin_mm[3];
  float axis[3];          // optical axis in the world
  float calibration_px2;  // variance that the calibration leaves in a projected point
  float spare[6];
  double fx_px, fy_px, cx_px, cy_px;
  double distortion[8];
  double rotation[9];
  double safe_square;  // up to this squared distance from the axis the lens model is one-to-one
};

// A ray: `along` is scaled so that its depth is 1; pixel_from_offset [2, 3], row by row, is that of Sight.
// One cache line, so that sorting rays by node moves whole lines.
struct alignas(64) RayRecord {
  double along[3];
  float pixel_from_offset[6];
  float sigma_px;
  int32_t camera;
  int32_t valid;  // 0 where the plain path has to look
  int32_t spare;
};
static_assert(sizeof(RayRecord) == 64);

// Pixels of one camera, and where their rays belong.
struct RayColumns {
  static constexpr int kCount = 64;
  alignas(64) double x_px[kCount], y_px[kCount];
  float sigma_px[kCount];
  int32_t valid[kCount];  // as in the records
  RayRecord* record[kCount];
};

// 16 rays of a node in short numbers, from a reference point near the node: its distances are small, so
// floats hold them to a millionth of a mm.
struct alignas(64) LocalTile {
  float foot_mm[3][kRayLanes];  // the ray's nearest point to the reference; far away in lanes without a ray
  float along[3][kRayLanes];
  float inverse_square[kRayLanes];  // of `along`
  float pixel_from_offset[6][kRayLanes];
  float axis[3][kRayLanes];
  float depth_mm[kRayLanes];  // of the reference
  float inverse_variance[kRayLanes];
  float limit_px2[kRayLanes];  // largest squared residual of an inlier
  float member[kRayLanes];     // 1 where the ray takes part
  float inlier[kRayLanes];     // 1 where it should, by the last look
  float residual_px2[kRayLanes];
};

struct RayLimits {
  float radius_mm2 = 0;  // squared distance of an inlier
  float min_sigma_px = 0;
  float max_residual_sigmas = 0;
  float min_residual_px = 0;
  float huber_sigmas = 0;
};

// Rays near a point, and the sum of their squared distances.
struct RayScore {
  int rays = 0;
  float squared_mm2 = 0;
};

// Gauss-Newton system of the reprojection error over the members.
struct RaySystem {
  float matrix[6];    // xx xy xz yy yz zz
  float gradient[3];  // Jacobian times residual
  float chi_square;
  bool in_front;  // the point lies behind no member's camera
};

struct RayKernels {
  // Writes the records of the pixels and columns->valid; `count` is at most RayColumns::kCount. Columns
  // behind it up to a multiple of 16 are read as well.
  void (*unproject)(const RayCamera* cameras, int camera, int count, RayColumns* columns);
  // Records up to the next multiple of 16 hold finite numbers and a camera of the rig.
  void (*localise)(const RayCamera* cameras, const RayRecord* records, int rays, const double* reference_mm,
                   const RayLimits& limits, LocalTile* local);
  // `point_mm` is relative to the reference. Gives up, with fewer rays than there are, as soon as it cannot
  // reach at_least rays.
  RayScore (*score)(const LocalTile* local, int rays, const float* point_mm, float radius_mm2, int at_least);
  // Writes inlier and residual_px2 of every ray at the point, and the system over the members; with
  // select_by_radius those within the radius become members first, whatever their residuals.
  void (*linearise)(LocalTile* local, int rays, const float* point_mm, const RayLimits& limits,
                    bool select_by_radius, RaySystem* system);
};

// The fastest that this processor runs.
const RayKernels& BestRayKernels();

namespace baseline {
extern const RayKernels kRayKernels;
}
#ifdef __x86_64__
namespace avx2 {
extern const RayKernels kRayKernels;
}
namespace avx512 {
extern const RayKernels kRayKernels;
}
#endif

}  // namespace weft
