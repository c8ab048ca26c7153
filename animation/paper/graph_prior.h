// Which poses of a deformation graph are likely: a few numbers, normally distributed, from which a net of
// fully connected layers makes the pose (Halimi et al. 2022, section 6.2.2). One layer alone is a linear
// space.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/paper/deformation_graph.h"

namespace weft {

struct PriorLayer {
  int from = 0, to = 0;
  std::vector<float> weight, bias;  // [to][from], [to]
};

// What a layer passes on below 0 (leaky ReLU), but for the last.
inline constexpr float kPriorLeak = 0.2f;

struct GraphPrior {
  std::vector<float> unit;  // [6 * (nodes - 1)], what the last layer's numbers count in; the root has none
  std::vector<PriorLayer> layers;

  int latents() const { return layers.empty() ? 0 : layers.front().from; }
  int nodes() const { return static_cast<int>(unit.size() / 6) + 1; }
  // `ways` may be null: [6 * nodes][latents], how the pose changes with z.
  GraphPose Decode(const Eigen::VectorXd& z, Eigen::MatrixXd* ways) const;

  // InvalidArgument names what is wrong: layers that do not follow each other or fit another graph, numbers
  // that are not finite.
  absl::Status Validate(int nodes) const;
};

// Numbers of a pose, the root's left out, [6 * (nodes - 1)].
Eigen::VectorXd NumbersOf(const GraphPose& pose);

// What PoseUnits is asked for where a prior is learnt.
inline constexpr double kPoseUnitMm = 10;

// For each of these numbers the change that moves the mesh at rest by `move_mm` (root mean square).
std::vector<float> PoseUnits(const DeformationGraph& graph, double move_mm);

// Principal components of poses, [frames] of NumbersOf, in these units. InvalidArgument for fewer than two.
absl::StatusOr<GraphPrior> LearnLinearPrior(const std::vector<Eigen::VectorXd>& poses,
                                            std::vector<float> unit, int components);

}  // namespace weft
