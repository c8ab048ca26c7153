// How good a garment is that few cameras drive, against the truth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "evaluation/error_tally.h"

namespace weft {

// A mesh to be scored. Sigma is the distance that about 68 % of the vertices keep, twice it that of 95 %.
struct ScoredMesh {
  std::vector<Eigen::Vector3d> vertices_mm;  // [vertices]
  std::vector<float> sigma_mm;               // [vertices]; empty: not known
};

// The rays that a frame's observations give its vertices: what lies across them is observed.
class VertexRays {
 public:
  explicit VertexRays(size_t vertices) : across_(vertices, Eigen::Matrix3d::Zero()), count_(vertices, 0) {}

  // A ray of unit direction through the vertex.
  void Add(size_t vertex, const Eigen::Vector3d& direction) {
    across_[vertex] += Eigen::Matrix3d::Identity() - direction * direction.transpose();
    ++count_[vertex];
  }

  size_t size() const { return count_.size(); }
  int CountAt(size_t vertex) const { return count_[vertex]; }
  // Root mean square over the vertex's rays of the part of the error across the ray.
  double AcrossMm(size_t vertex, const Eigen::Vector3d& error_mm) const;

 private:
  std::vector<Eigen::Matrix3d> across_;
  std::vector<int> count_;
};

// Collects frames of a sequence in their order; += joins sequences.
class DrivingScore {
 public:
  // A vertex further off than this is lost.
  static constexpr double kLostMm = 80;

  // `follows`: the frame comes right after the one before; jitter is not measured over gaps.
  // InvalidArgument: other numbers of vertices than `truth_mm`, or positions that are not finite.
  absl::Status Add(const ScoredMesh& mesh, const std::vector<Eigen::Vector3d>& truth_mm,
                   const VertexRays& rays, bool follows);
  DrivingScore& operator+=(const DrivingScore& other);

  int frames() const { return frames_; }
  // Distances in mm of the vertices to their true place: of all, of those that a camera saw, and of the
  // others.
  const ErrorTally& all_mm() const { return all_mm_; }
  const ErrorTally& seen_mm() const { return seen_mm_; }
  const ErrorTally& unseen_mm() const { return unseen_mm_; }
  // Of those that two cameras and more saw.
  const ErrorTally& crossed_mm() const { return crossed_mm_; }
  // Across the rays that saw the vertex.
  const ErrorTally& across_mm() const { return across_mm_; }
  // Between the sets of vertices, of each frame.
  const ErrorTally& chamfer_mm() const { return chamfer_mm_; }
  // Length of the second difference of the error over three frames: the cloth's own acceleration is no part
  // of it. By whether a camera saw the vertex in the middle one.
  const ErrorTally& error_jitter_seen_mm() const { return error_jitter_seen_mm_; }
  const ErrorTally& error_jitter_unseen_mm() const { return error_jitter_unseen_mm_; }
  // Share of the vertices whose distance is below one and two sigma; about 68 % and 95 % where sigma is
  // right. Empty where it is not known.
  std::optional<double> ShareWithin(int sigmas) const;
  // Vertices beyond kLostMm, of all frames.
  int64_t lost() const { return lost_; }
  // Share of the vertices that no camera saw; empty without frames.
  std::optional<double> UnseenShare() const;

 private:
  struct Moment {
    std::vector<Eigen::Vector3d> error_mm;
    std::vector<bool> seen;
  };
  void AddErrorJitter(const Moment& last);

  int frames_ = 0;
  int64_t lost_ = 0, with_sigma_ = 0, within_one_ = 0, within_two_ = 0;
  ErrorTally all_mm_, seen_mm_, crossed_mm_, unseen_mm_, across_mm_, chamfer_mm_;
  ErrorTally error_jitter_seen_mm_, error_jitter_unseen_mm_;
  std::vector<Moment> recent_;  // the last two at most
};

}  // namespace weft
