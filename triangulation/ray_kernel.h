// The inner loops of triangulation: 16 nodes side by side, camera by camera, compiled for several instruction
// sets. What belongs to one node never meets what belongs to another, so all give the same bytes.
#pragma once

#include <cstdint>

#include "pattern/observation.h"
#include "simd/dispatch.h"

namespace weft {

inline constexpr int kNodeLanes = 16;

// A camera as the kernels need it.
struct RayCamera {
  double rotation[9];          // camera_from_world, row by row
  double inverse_focal_px[2];  // 1 / fx_px, 1 / fy_px
  double center_px[2];
  double translation_mm[3];  // camera_from_world
  double origin_mm[3];
  float calibration_px2;  // variance that the calibration leaves in a projected point
  bool rational;          // k4, k5 or k6 are not 0
  float safe_square;      // up to this squared distance from the axis the lens model is one-to-one
  struct Floats {
    float rotation[9];
    float fx_px, fy_px;
    float distortion[8];  // k1 k2 p1 p2 k3 k4 k5 k6
  } rough;
};

// What one camera saw of the nodes of a group. A camera that saw one of them more than once has several rows,
// one behind the other.
struct alignas(64) RayRow {
  float sigma_px[kNodeLanes];  // 0 where it did not see the node
  // The pixels on the plane z = 1 of the camera, still distorted.
  float pixel[2][kNodeLanes];
  // From there to the rays, good to a thousandth of a pixel; NaN where there is none. Before `undistort`,
  // what the floats lack of the pixels.
  float to_ray[2][kNodeLanes];
  float lens[3][kNodeLanes];  // derivative of the pixel by the ray: xx xy yy; 0 where there is none
  int32_t camera;
  bool repeated;      // of the same camera as the row before
  const void* ahead;  // what the camera saw of the next nodes; may be null
};
// Bytes that are fetched from there while the nodes at hand are solved for.
inline constexpr int kBytesAhead = 40 * kNodeLanes;

// A row as seen from a point near each node: the residual of the reprojection and its derivative by the
// point. With the depth it is exact but for the curvature of the lens between ray and point.
struct alignas(64) LinearRow {
  float residual_px[2][kNodeLanes];    // predicted minus observed
  float jacobian[2][3][kNodeLanes];    // px per mm
  float inverse_variance[kNodeLanes];  // 0 where there is no ray, or the lens model does not reach
  float weight[kNodeLanes];            // that of the rays that take part, else 0
  float limit_px2[kNodeLanes];         // largest squared residual of an inlier
  float inlier[kNodeLanes];            // 1 where the ray should take part, by the last look
  float axis[3];                       // optical axis of the camera over the depth of the anchor
};

// A point per node. Numbers of a kernel are as exact as the points are near that of lane `anchor`.
struct RayPoints {
  double mm[3][kNodeLanes];
  int anchor = 0;
};

// Steps from the points, of the nodes whose systems are wanted.
struct RaySteps {
  float mm[3][kNodeLanes] = {};
  int32_t wanted[kNodeLanes] = {};  // 0: the node's system may stay as it was
};

struct RayLimits {
  float radius_mm2 = 0;  // squared distance of an inlier
  float min_sigma_px = 0;
  float max_residual_sigmas = 0;
  float min_residual_px = 0;
  float huber_sigmas = 0;
  bool checks_distance = true;  // in `accumulate`; false where residual limits keep all inliers in the radius
};

// Cameras with a ray near the points, and the sums of the squared distances of their closest ones.
struct alignas(64) GroupScore {
  float cameras[kNodeLanes];
  float squared_mm2[kNodeLanes];
};

// Normal equations of the reprojection error over the rays that take part.
struct alignas(64) GroupSystem {
  float matrix[6][kNodeLanes];  // xx xy xz yy yz zz, of least squares with Huber's weights
  // What the second derivative of Huber's loss lacks of it: a ray beyond the bound pulls with a constant
  // force, so along its residual nothing is left.
  float surplus[6][kNodeLanes];
  float gradient[3][kNodeLanes];  // Jacobian times residual
  float chi_square[kNodeLanes];
  float inliers[kNodeLanes];
  int32_t changed[kNodeLanes];  // not 0 where other rays take part
};

// What follows from the systems. Steps are to be taken away.
struct alignas(64) GroupSolution {
  double covariance_mm2[6][kNodeLanes];  // inverse of the matrix; times the gradient, a step of least squares
  int32_t solvable[kNodeLanes];          // 0 where the rays do not fix a point
  double newton_step_mm[3][kNodeLanes];  // on Huber's loss
  int32_t newton[kNodeLanes];            // 0 where too many rays are beyond the bound for it
};

struct RayKernels {
  // Fills a row, but for its number of the camera and its rays, from one observation of each node. False
  // where they do not have the nodes of the first one's row in order, or some value is not finite, or no
  // positive sigma.
  bool (*read)(const RayCamera& camera, const Observation* seen, RayRow* row);
  // Takes the lens out of the pixels.
  void (*undistort)(const RayCamera* cameras, int count, RayRow* rows);
  // Ends early once each node has `enough` cameras.
  void (*score)(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points,
                float radius_mm2, const float* enough, GroupScore* score);
  // The rows at the points; inliers are all rays within the radius. Those that take part still do. Returns
  // RayLimits::checks_distance for what follows.
  bool (*linearise)(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points,
                    const RayLimits& limits, LinearRow* linear);
  // The same, all rays within the radius take part, and the systems at the points are summed up on the
  // way: least squares, without Huber's weight, whose points lie nearer to the robust ones than these do.
  // Counts no inliers. Memory is idle meanwhile, so it fetches what is ahead.
  bool (*start)(const RayCamera* cameras, const RayRow* rows, int count, const RayPoints& points,
                const RayLimits& limits, LinearRow* linear, GroupSystem* system);
  // At the steps from the points: writes inliers, which are the rays within the radius and the residual
  // limit, and the systems over the rays that take part.
  void (*accumulate)(LinearRow* rows, int count, const RaySteps& steps, const RayLimits& limits,
                     GroupSystem* system);
  // Inverts the matrices, and takes the steps from them.
  void (*solve)(const GroupSystem& system, GroupSolution* solution);
};

// The fastest that this processor runs.
const RayKernels& BestRayKernels();

WEFT_DECLARE_BUILDS(RayKernels, kRayKernels)

}  // namespace weft
