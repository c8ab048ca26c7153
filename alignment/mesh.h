// Triangle meshes with fixed topology.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace weft {

using Face = std::array<int, 3>;

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<Face> faces;  // counter-clockwise seen from outside
};

// How the position of a registered vertex is known.
enum class VertexState : uint8_t {
  kInferred = 0,  // by the cloth around it
  kObserved = 1,  // measured by three or more cameras
  kTwoView = 2,   // measured by two
  kBridged = 3,   // the whole frame comes from its neighbours in time
  kDriven = 4,    // by what an avatar learnt of the garment, and at most one camera
};

// The template's vertices at one frame, in the template's order.
struct RegisteredMesh {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<VertexState> state;
  std::vector<float> sigma_mm;
  std::vector<int> views;
};

}  // namespace weft
