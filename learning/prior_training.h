// The training of a deformation graph's prior: a variational autoencoder of its poses (Halimi et al. 2022,
// section 6.2.2).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "learning/net_training.h"

namespace weft::learning {

struct PriorTraining {
  int64_t steps = 4000;
  int batch = 64;
  double rate = 1e-3;
  int64_t latents = 32;
  std::vector<int64_t> widths = {256, 512};  // of the decoder's hidden layers; the encoder has them reversed
  // Of the divergence from the normal distribution, against the mean squared distance of the vertices in
  // mm^2.
  double divergence = 0.02;
  int64_t vertices = 1000;  // of each step's meshes that are compared, at most
  uint64_t seed = 1;
};

struct TrainedPrior {
  bool is_finished = false;
  std::string tables;  // of the decoder: "weight<k>" and "bias<k>", [to][from] and [1][to]
};

// `tables`: a file of EncodePriorTask (services/work/animation/graph_poses.h). The loss is on the meshes that
// the poses make, not on the poses. Scores of held-out poses have 0 cameras: mean distances of the vertices
// from those of the likeliest pose, and of what the autoencoder makes of them. The same bytes for the same
// file, options, machine and number of threads. Throws std::runtime_error for tables that are missing or do
// not fit.
TrainedPrior TrainPrior(const std::string& tables, const PriorTraining& training,
                        const std::function<void(const NetProgress&)>& on_progress,
                        const std::function<bool()>& stopped);

}  // namespace weft::learning
