// What a training needs to go on as if it had not been stopped.
#pragma once

#include <torch/nn.h>
#include <torch/optim.h>

#include <cstdint>
#include <string>

namespace weft::learning {

struct TrainingState {
  int64_t step = 0;    // steps taken
  double minutes = 0;  // that they took, of all runs
};

// Model, optimiser, state, and that of torch's generator of random numbers. The file appears whole, or the
// one before stays.
void SaveCheckpoint(const std::string& path, torch::nn::Module& model, torch::optim::Optimizer& optimizer,
                    const TrainingState& state);

// Into a model and an optimiser of the same kind. Files of earlier versions leave the generator as it is:
// their trainings drew nothing from it. Throws c10::Error for a file of another model, and what is none.
TrainingState LoadCheckpoint(const std::string& path, torch::nn::Module& model,
                             torch::optim::Optimizer& optimizer);

}  // namespace weft::learning
