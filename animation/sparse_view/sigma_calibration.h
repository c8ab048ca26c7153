// How large sigma must be: driven meshes against the truth before imagined cameras.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "alignment/align.h"
#include "animation/avatar/sigma_scale.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/sparse_view/net_correction.h"

namespace weft {

// Collects how far driven vertices are off, beside RayDrivenFrame::scale_mm and growth_mm.
class SigmaCalibration {
 public:
  // Frames of a run that count at most, after those in which tracking settles.
  static constexpr int kRunFrames = 4, kSettlingFrames = 3;

  SigmaCalibration(const Template& garment, const AlignmentModel& model);

  // Drives the avatar over frames that follow each other, before 1 to SigmaScale::kCameras cameras at equal
  // angles; `seed` turns them about the garment. `net`, which may be null, is that of the avatar. Errors of
  // ImagineRays and RayDriver.
  absl::Status Add(const SparseViewAvatar& avatar, const std::vector<std::vector<Eigen::Vector3d>>& run,
                   uint64_t seed, NetCorrection* net = nullptr);
  SigmaCalibration& operator+=(const SigmaCalibration& other);
  // Of the same garment, without errors.
  SigmaCalibration Empty() const;

  int frames() const { return frames_; }  // that counted, each before all numbers of cameras
  // What nets made of the frames that they corrected, for each number of cameras.
  const std::array<NetGain, SigmaScale::kCameras>& gain() const { return gain_; }
  // The factors that put the shares of one and two sigmas right, as well as one factor can; the share of one
  // is never too small. Classes that hardly occur keep the proportion of the typical ones to a neighbour that
  // is known.
  SigmaScale Scales() const;
  // What they make of the frames that were added.
  SigmaCheck Check(const SigmaScale& scales) const;

 private:
  std::vector<Face> faces_;
  const AlignmentModel& model_;
  std::vector<bool> is_node_;
  int frames_ = 0;
  std::array<NetGain, SigmaScale::kCameras> gain_{};
  struct VertexError {
    float error_mm = 0, scale_mm = 0, growth_mm = 0;
  };
  // The factor of vertices without a ray that puts their shares right, beside the other factors.
  static float GrowthFactor(const std::vector<VertexError>& errors,
                            std::array<float, SigmaScale::kRays> factors);

  // Of some of the vertices.
  std::array<std::array<std::vector<VertexError>, SigmaScale::kRays>, SigmaScale::kCameras> errors_;
};

}  // namespace weft
