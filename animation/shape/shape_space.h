// The shapes that a garment takes, as a linear space: the mean of its vertices and how they vary together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// Recorded meshes of one garment, read as they are needed, each several times. `read` gives the vertices in
// mm, [vertices], of frame 0 to frames - 1; it is called from the calling thread only.
struct MeshFrames {
  int frames = 0;
  std::function<absl::StatusOr<std::vector<Eigen::Vector3d>>(int frame)> read;
};

// Shapes without where the garment is: a shape is mean + sum of z_k sigma_mm[k] basis_k, and z is of unit
// variance over the frames that were learnt. Numbers of a vertex follow each other: x, y, z.
struct ShapeSpace {
  int vertices = 0;
  std::vector<float> mean_mm;  // [vertices][3], the mean of its vertices is the origin
  std::vector<float> basis;    // [components][vertices][3], orthonormal
  std::vector<float>
      sigma_mm;        // [components], falling; of the whole garment, so it grows with sqrt(vertices)
  double left_mm = 0;  // root mean square per vertex and axis of what the components leave

  int components() const { return static_cast<int>(sigma_mm.size()); }

  // z, of any number of components up to all, to vertices in mm, in the space's own axes.
  std::vector<Eigen::Vector3d> Shape(const Eigen::VectorXd& z) const;
  // The nearest shape's z to vertices in the space's own axes.
  Eigen::VectorXd Project(const std::vector<Eigen::Vector3d>& aligned_mm) const;

  // InvalidArgument names what is wrong: sizes, numbers that are not finite, sigmas that do not fall.
  absl::Status Validate() const;
};

struct ShapeSpaceOptions {
  int components = 48;
  int rounds = 3;  // of subspace iteration; the first components are exact after fewer
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// Principal components of the frames, each brought onto the mean by a rigid motion first. By randomised
// subspace iteration (Halko et al. 2011), reading the frames rounds + 4 times, so that the memory depends on
// the components and not on the frames. `on_progress` (may be empty) is called with the share done.
// InvalidArgument for fewer than two frames, or for a frame of other vertices; no more components than
// frames - 1 are made. Cancelled when `stop` is requested. The same result at any thread count.
absl::StatusOr<ShapeSpace> LearnShapeSpace(const MeshFrames& frames, const ShapeSpaceOptions& options,
                                           const std::function<void(double)>& on_progress = {},
                                           const std::stop_token& stop = {});

}  // namespace weft
