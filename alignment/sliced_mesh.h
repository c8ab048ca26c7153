// The mesh and the fields of the elastic solver, in slices of sixteen vertices.
#pragma once

#include <cstdint>
#include <vector>

#include "alignment/elastic_kernel.h"
#include "alignment/mesh_graph.h"

namespace weft {

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

// Four numbers per vertex, one behind the other: what is gathered from all over the mesh.
using Records = std::vector<float>;

// Neighbours and rest edges in slices of sixteen vertices: slot j of slice s holds the j-th neighbour of its
// vertices. Missing neighbours are the vertex itself with a rest edge of 0, which adds nothing anywhere.
struct SlicedMesh {
  int vertices = 0;
  int slices = 0;
  std::vector<int32_t> first_slot;            // [slices + 1]
  std::vector<int32_t> neighbor;              // [slots][16]
  std::vector<float> rest_x, rest_y, rest_z;  // [slots][16], from the vertex to the neighbour
  std::vector<float> degree;                  // [slices * 16]

  SliceTables tables() const {
    return {first_slot.data(), neighbor.data(), {rest_x.data(), rest_y.data(), rest_z.data()}};
  }
};
SlicedMesh SliceMesh(const TriangleMesh& rest, const MeshGraph& graph);

}  // namespace weft
