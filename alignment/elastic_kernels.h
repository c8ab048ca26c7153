// Loops of the elastic solver over all vertices, sixteen at a time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "alignment/distortion.h"
#include "alignment/mesh_graph.h"

namespace weft {

inline constexpr int kLanes = 16;

// A 3-vector per vertex, one array per coordinate, padded to whole slices.
struct Field3 {
  std::vector<float> x, y, z;
  void Resize(size_t size) { x.resize(size), y.resize(size), z.resize(size); }
};

// A symmetric 3x3 matrix per vertex.
struct FieldSym {
  std::vector<float> xx, xy, xz, yy, yz, zz;
  void Resize(size_t size) {
    xx.resize(size), xy.resize(size), xz.resize(size), yy.resize(size), yz.resize(size), zz.resize(size);
  }
};

// A unit quaternion per vertex.
struct FieldQ {
  std::vector<float> w, x, y, z;
  void Resize(size_t size) { w.resize(size, 1), x.resize(size), y.resize(size), z.resize(size); }
};

// Neighbours and rest edges in slices of sixteen vertices: slot j of slice s holds the j-th neighbour of its
// vertices. Missing neighbours are the vertex itself with a rest edge of 0, which adds nothing anywhere.
struct SlicedMesh {
  int vertices = 0;
  int slices = 0;
  std::vector<int> first_slot;                // [slices + 1]
  std::vector<int32_t> neighbor;              // [slots][16]
  std::vector<float> rest_x, rest_y, rest_z;  // [slots][16], from the vertex to the neighbour
  std::vector<float> degree;                  // [slices * 16]
};
SlicedMesh SliceMesh(const TriangleMesh& rest, const MeshGraph& graph);

// A range of slices.
struct SliceRange {
  int first = 0, last = 0;
};

// For each vertex the rotation R that maximises the sum over its edges of
// (R e) . (along_edge * d + along_neighbor * R_neighbor e + along_own * R_current e), by Newton steps from
// `current`. All vertices step at once; along_own damps the swing that this brings.
struct RotationStep {
  float along_edge = 3;
  float along_neighbor = -0.5f;
  float along_own = 0;
  int newton_steps = 1;
};
void FitRotations(const SlicedMesh& mesh, SliceRange range, const RotationStep& step, const Field3& position,
                  const FieldQ& current, FieldQ* next);

// Energy and half its gradient by the positions, at fixed rotations:
// sum of (position - target)^T weight (position - target) + sum over edges of
// stretch |d - m|^2 + bending |a - b|^2.
struct EnergyTerms {
  const Field3* target = nullptr;
  const FieldSym* weight = nullptr;
  float stretch = 3, bending = 0.5f;  // lambda included
};
double EnergyAndGradient(const SlicedMesh& mesh, SliceRange range, const EnergyTerms& terms,
                         const Field3& position, const FieldQ& rotation, Field3* half_gradient);

}  // namespace weft
