#include "learning/training_loop.h"

#include <torch/torch.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

#include "learning/checkpoint.h"

namespace weft::learning {
namespace {

constexpr double kLastRate = 0.02;
constexpr double kMinutesBetweenValidations = 1, kMinutesBetweenReports = 0.05;

class TrainingRun {
 public:
  TrainingRun(Learner& learner, const TrainingOptions& options, const ProgressCall& on_progress)
      : learner_(learner),
        options_(options),
        on_progress_(on_progress),
        optimizer_(learner.model().parameters(),
                   torch::optim::AdamWOptions(options.rate).weight_decay(learner.descent().weight_decay)) {
    if (!options.checkpoint.empty() && std::filesystem::exists(options.checkpoint)) {
      const TrainingState state = LoadCheckpoint(options.checkpoint, learner.model(), optimizer_);
      step_ = state.step, minutes_before_ = state.minutes;
    }
    start_ = std::chrono::steady_clock::now();
    looked_ = reported_ = saved_ = Minutes();
  }

  int64_t step() const { return step_; }

  double Done() const {
    const double of_time = options_.minutes > 0 ? Minutes() / options_.minutes : 0;
    return std::max(of_time, static_cast<double>(step_) / static_cast<double>(options_.steps));
  }

  void Step() {
    const Descent descent = learner_.descent();
    const double rate = RateAt(options_.rate, std::min(1.0, Done()), step_, descent.warm_up_steps);
    for (auto& group : optimizer_.param_groups())
      static_cast<torch::optim::AdamWOptions&>(group.options()).lr(rate);
    const torch::Tensor loss = learner_.Loss(step_);
    optimizer_.zero_grad();
    loss.backward();
    torch::nn::utils::clip_grad_norm_(learner_.model().parameters(), descent.largest_gradient);
    optimizer_.step();
    losses_ += loss.item<double>(), ++steps_since_, ++step_;
  }

  void Validate() {
    Report(learner_.Score());
    looked_ = Minutes();
  }
  void Save() {
    if (!options_.checkpoint.empty())
      SaveCheckpoint(options_.checkpoint, learner_.model(), optimizer_, {step_, Minutes()});
    saved_ = Minutes();
  }
  void DoWhatIsDue() {
    if (Minutes() - looked_ > kMinutesBetweenValidations) Validate();
    if (Minutes() - reported_ > kMinutesBetweenReports) Report({});
    if (Minutes() - saved_ > options_.checkpoint_minutes) Save();
  }

 private:
  double Minutes() const {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
    return minutes_before_ + passed.count() / 60;
  }
  void Report(std::vector<HeldOutScore> scores) {
    const double loss = steps_since_ > 0 ? losses_ / static_cast<double>(steps_since_) : 0;
    on_progress_({std::min(1.0, Done()), Minutes(), step_, loss, std::move(scores)});
    reported_ = Minutes(), losses_ = 0, steps_since_ = 0;
  }

  Learner& learner_;
  const TrainingOptions& options_;
  const ProgressCall& on_progress_;
  torch::optim::AdamW optimizer_;
  std::chrono::steady_clock::time_point start_;
  int64_t step_ = 0, steps_since_ = 0;
  double minutes_before_ = 0;  // of earlier runs
  double looked_ = 0, reported_ = 0, saved_ = 0, losses_ = 0;
};

}  // namespace

double RateAt(double rate, double done, int64_t step, int64_t warm_up_steps) {
  const double share = 0.5 * (1 + std::cos(std::numbers::pi * done));
  const double warm = warm_up_steps > 0
                          ? std::min(1.0, static_cast<double>(step + 1) / static_cast<double>(warm_up_steps))
                          : 1;
  return rate * (kLastRate + (1 - kLastRate) * share) * warm;
}

Trained Train(const std::function<std::unique_ptr<Learner>()>& make, const TrainingOptions& options,
              const ProgressCall& on_progress, const std::function<bool()>& stopped) {
  torch::manual_seed(options.seed);
  const std::unique_ptr<Learner> learner = make();
  TrainingRun run(*learner, options, on_progress);
  run.Validate();
  while (run.Done() < 1) {
    if (stopped()) {
      run.Save();
      return {};
    }
    run.Step();
    run.DoWhatIsDue();
  }
  run.Validate();
  return {true, run.step(), learner->Export()};
}

}  // namespace weft::learning
