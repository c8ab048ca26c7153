// The training of a deformation graph's prior: a variational autoencoder of its poses (Halimi et al. 2022,
// section 6.2.2).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "learning/training_loop.h"

namespace weft::learning {

struct PriorTraining {
  TrainingOptions options{.steps = 4000, .batch = 64};
  int64_t latents = 32;
  std::vector<int64_t> widths = {256, 512};  // of the decoder's hidden layers; the encoder has them reversed
  // Of the divergence from the normal distribution, against the mean squared distance of the vertices in
  // mm^2.
  double divergence = 0.02;
  int64_t vertices = 1000;  // of each step's meshes that are compared, at most
};

// Its file has the decoder's tables: "weight<k>" and "bias<k>", [to][from] and [1][to]. Scores of held-out
// poses have 0 cameras: mean distances of the vertices from those of the likeliest pose, and of what the
// autoencoder makes of them.
inline constexpr char kPriorFile[] = "prior.bin";

// `tables`: a file of EncodePriorTask (services/work/animation/graph_poses.h). The loss is on the meshes that
// the poses make, not on the poses. Throws std::runtime_error for tables that are missing or do not fit.
std::unique_ptr<Learner> MakePriorLearner(const std::string& tables, const PriorTraining& training);

}  // namespace weft::learning
