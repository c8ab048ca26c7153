// The loop that all trainings share. A kind of training gives its data, its loss and its model.
#pragma once

#include <torch/nn.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace weft::learning {

struct TrainingOptions {
  int64_t steps = 8000;
  double minutes = 0;  // it ends after these at the latest, earlier runs included; 0: it takes its time
  int batch = 4;       // samples a step
  double rate = 1e-3;  // of the optimiser, at the start
  uint64_t seed = 1;
  // File that is written every few minutes and when the training is stopped; one that is there is gone on
  // from. Empty: none.
  std::string checkpoint{};
  double checkpoint_minutes = 4;
};

// Mean distance from the truth over held-out samples, before the model was asked and after.
struct HeldOutScore {
  int cameras = 0, samples = 0;
  double before_mm = 0, after_mm = 0;
};

struct TrainingProgress {
  double share = 0;  // of the training
  double minutes = 0;
  int64_t step = 0;
  double loss = 0;                   // mean since the last report
  std::vector<HeldOutScore> scores;  // now and then
};
using ProgressCall = std::function<void(const TrainingProgress&)>;

// How a kind of model is optimised.
struct Descent {
  int64_t warm_up_steps = 0;  // in which the rate rises
  double weight_decay = 0;
  double largest_gradient = 1;  // norm over all parameters, beyond which it is made shorter
};

// A kind of training. Random numbers are torch's alone, or follow from seed and step: a checkpoint keeps the
// state of torch's generator.
class Learner {
 public:
  virtual ~Learner() = default;

  // What checkpoints keep.
  virtual torch::nn::Module& model() = 0;
  virtual Descent descent() const = 0;
  // Of the batch of this step.
  virtual torch::Tensor Loss(int64_t step) = 0;
  // Of the model as it is, without random numbers. Empty where nothing is held out.
  virtual std::vector<HeldOutScore> Score() = 0;
  // Names and bytes of what was learnt.
  virtual std::map<std::string, std::string> Export() = 0;
};

struct Trained {
  bool is_finished = false;  // not so when it was stopped; the rest is empty then
  int64_t steps = 0;         // fewer than asked for where the time ended first
  std::map<std::string, std::string> files;
};

// AdamW, the rate falling as a cosine of the steps, or of the time where that ends sooner. `make` is called
// when torch's generator has its seed. `on_progress` is called every few seconds; before the first step,
// about once a minute, and at the end with scores. The same bytes for the same data, options without minutes,
// machine and number of threads, also when the training is stopped or killed and goes on. Throws what the
// learner throws, and c10::Error for a checkpoint of another model.
Trained Train(const std::function<std::unique_ptr<Learner>()>& make, const TrainingOptions& options,
              const ProgressCall& on_progress, const std::function<bool()>& stopped);

// Learning rate with `done` of the training done, 0 to 1: a cosine from `rate` down, after a warm-up.
double RateAt(double rate, double done, int64_t step, int64_t warm_up_steps);

}  // namespace weft::learning
