// What a net is told of a driven frame, vertex by vertex, and what it answers.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "alignment/align.h"
#include "animation/atlas/canonical.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/rays/evidence.h"
#include "animation/sparse_view/ray_driver.h"

namespace weft {

// Numbers of a vertex, all of the order of 1. Vectors are in the canonical axes of the driven mesh where
// nothing else is said:
//   0  1, so that an image of it says where cloth is
//   1  offset of the driven mesh from its carrier / 20 mm
//   4  (I - d d^T) summed over the vertex's rays, divided by their number: xx yy zz xy xz yz
//  10  number of rays / 3
//  11  mean direction of the rays
//  14  normal, in the axes of the shape space
//  17  position, in the axes of the shape space / 500 mm
//  20  position at rest, from its middle / 500 mm
//  23  mean of length over learnt length, minus 1, over the edges * 20
//  24  the same of the carrier
//  25  what the space leaves there / 10 mm
//  26  how badly the rays around fit the carrier, over what is usual, capped at 4
inline constexpr int kDrivingFeatures = 27;
// Answer: offset from the driven mesh / 2 mm, and the log of its deviation per axis / 2 mm.
inline constexpr int kDrivingAnswers = 4;
inline constexpr double kAnswerUnitMm = 2;
// What lies beyond is no measurement; the trainer cuts there, too.
inline constexpr float kMostFeature = 5;

class DrivingFeatures {
 public:
  // Model and avatar must outlive it.
  DrivingFeatures(const AlignmentModel& model, const SparseViewAvatar& avatar);

  // [vertices][kDrivingFeatures]. Rays that the frame rejected count as if they were not there.
  std::vector<float> Of(const RayDrivenFrame& frame, std::span<const VertexRay> rays,
                        std::span<const Eigen::Matrix3f> canonical) const;
  const CanonicalAxes& axes() const { return axes_; }

 private:
  std::vector<float> StretchOf(const std::vector<Eigen::Vector3d>& position_mm) const;

  const AlignmentModel& model_;
  const SparseViewAvatar& avatar_;
  CanonicalAxes axes_;
  Eigen::Vector3d rest_middle_mm_;
};

}  // namespace weft
