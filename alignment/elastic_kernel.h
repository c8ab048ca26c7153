// The inner loops of the elastic solver, sixteen vertices side by side, compiled for several instruction
// sets. Vertices never mix and products are never fused, so all give the same bytes.
#pragma once

#include <cstdint>

#include "simd/dispatch.h"

namespace weft {

inline constexpr int kSliceLanes = 16;

// A range of slices of sixteen vertices.
struct SliceRange {
  int first = 0, last = 0;
};

// What the kernels read of a SlicedMesh.
struct SliceTables {
  const int32_t* first_slot;
  const int32_t* neighbor;
  const float* rest[3];
};

// For each vertex the rotation R that maximises the sum over its edges of
// (R e) . (along_edge * d + along_neighbor * R_neighbor e + along_own * R_current e), by Newton steps from
// R_current. All vertices step at once; along_own damps the swing that this brings.
struct RotationStep {
  float along_edge = 3;
  float along_neighbor = -0.5f;
  float along_own = 0;
  int newton_steps = 1;
};

// The energy: sum of (position - target)^T weight (position - target) + sum over edges of
// stretch |d - m|^2 + bending |a - b|^2.
struct EnergyTables {
  const float* target[3];
  const float* weight[6];  // xx xy xz yy yz zz
  float stretch, bending;  // lambda included
};

// Positions are records x y z 0, rotations w x y z (unit quaternions).
struct ElasticKernels {
  void (*fit_rotations)(const SliceTables& mesh, SliceRange range, const RotationStep& step,
                        const float* position, const float* current, float* next);
  // At fixed rotations; also half the gradient by the positions, an array per coordinate.
  double (*energy)(const SliceTables& mesh, SliceRange range, const EnergyTables& terms,
                   const float* position, const float* rotation, float* const* half_gradient);
};

// The fastest that this processor runs.
const ElasticKernels& BestElasticKernels();

WEFT_DECLARE_BUILDS(ElasticKernels, kElasticKernels)

}  // namespace weft
