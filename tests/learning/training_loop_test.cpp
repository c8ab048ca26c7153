#include "learning/training_loop.h"

#include <gtest/gtest.h>
#include <torch/torch.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft::learning {
namespace {

// Learns the weights of a sum from random numbers, of which every step draws others.
class SumLearner : public Learner {
 public:
  torch::nn::Module& model() override { return *layer_; }
  Descent descent() const override { return {.warm_up_steps = 5, .weight_decay = 0.01}; }
  torch::Tensor Loss(int64_t step) override {
    steps.push_back(step);
    const torch::Tensor numbers = torch::randn({8, 3});
    return (layer_->forward(numbers) - numbers.sum(1, true)).square().mean();
  }
  std::vector<HeldOutScore> Score() override {
    const torch::NoGradGuard no_grad;
    return {{3, 1, 1, (layer_->weight - 1).abs().max().item<double>()}};
  }
  std::map<std::string, std::string> Export() override {
    const torch::Tensor weight = layer_->weight.detach().contiguous();
    return {{"weights", {reinterpret_cast<const char*>(weight.data_ptr<float>()), 3 * sizeof(float)}}};
  }

  inline static std::vector<int64_t> steps;

 private:
  torch::nn::Linear layer_{3, 1};
};

class TrainingLoop : public testing::Test {
 protected:
  TrainingLoop() {
    SumLearner::steps.clear();
    options_.steps = 40;
    options_.rate = 0.1;
  }
  Trained Run(const std::function<bool()>& stopped = [] { return false; }) {
    progress_.clear();
    return Train([] { return std::make_unique<SumLearner>(); }, options_,
                 [this](const TrainingProgress& now) { progress_.push_back(now); }, stopped);
  }

  const TempFolder folder_;
  TrainingOptions options_;
  std::vector<TrainingProgress> progress_;
};

TEST_F(TrainingLoop, LearnsAndReports) {
  const Trained trained = Run();
  ASSERT_TRUE(trained.is_finished);
  EXPECT_EQ(trained.steps, 40);
  ASSERT_EQ(SumLearner::steps.size(), 40u);
  EXPECT_EQ(SumLearner::steps.back(), 39);
  ASSERT_GE(progress_.size(), 2u);
  EXPECT_EQ(progress_.front().share, 0);
  EXPECT_EQ(progress_.front().step, 0);
  EXPECT_EQ(progress_.back().share, 1);
  EXPECT_TRUE(std::any_of(progress_.begin(), progress_.end(), [](const auto& now) { return now.loss > 0; }));
  ASSERT_EQ(progress_.back().scores.size(), 1u);
  EXPECT_LT(progress_.back().scores[0].after_mm, 0.5 * progress_.front().scores[0].after_mm);
}

TEST_F(TrainingLoop, TheSameSeedGivesTheSameBytes) {
  const std::string first = Run().files.at("weights");
  EXPECT_EQ(Run().files.at("weights"), first);
  options_.seed = 2;
  EXPECT_NE(Run().files.at("weights"), first);
}

TEST_F(TrainingLoop, GoesOnFromWhereItWasStopped) {
  const std::string whole = Run().files.at("weights");
  options_.checkpoint = folder_ / "checkpoint.pt";
  int asked = 0;
  const Trained stopped = Run([&] { return ++asked > 17; });
  EXPECT_FALSE(stopped.is_finished);
  EXPECT_TRUE(stopped.files.empty());
  torch::randn({5});  // what another process would have drawn
  SumLearner::steps.clear();
  const Trained rest = Run();
  EXPECT_EQ(SumLearner::steps.front(), 17);
  EXPECT_EQ(progress_.front().step, 17);
  EXPECT_EQ(rest.steps, 40);
  EXPECT_EQ(rest.files.at("weights"), whole);
}

TEST_F(TrainingLoop, GoesOnFromItsLastCheckpointWhenItWasKilled) {
  const std::string whole = Run().files.at("weights");
  options_.checkpoint = folder_ / "checkpoint.pt";
  options_.checkpoint_minutes = 0;
  int asked = 0;
  const auto kill = [&]() -> bool {
    if (++asked > 9) throw std::runtime_error("killed");
    return false;
  };
  EXPECT_THROW(Run(kill), std::runtime_error);
  // What it was writing just then is not taken for a checkpoint.
  WriteBytes(options_.checkpoint + ".part", "half of one");
  SumLearner::steps.clear();
  EXPECT_EQ(Run().files.at("weights"), whole);
  EXPECT_EQ(SumLearner::steps.front(), 9);
}

TEST_F(TrainingLoop, EndsWithItsTime) {
  options_.steps = 100'000'000;
  options_.minutes = 0.005;
  const Trained trained = Run();
  EXPECT_TRUE(trained.is_finished);
  EXPECT_GT(trained.steps, 0);
  EXPECT_LT(trained.steps, options_.steps);
}

TEST(RateAt, RisesThenFallsAsACosine) {
  EXPECT_DOUBLE_EQ(RateAt(0.5, 0, 0, 4), 0.5 / 4);
  EXPECT_DOUBLE_EQ(RateAt(0.5, 0, 3, 4), 0.5);
  EXPECT_DOUBLE_EQ(RateAt(0.5, 0, 0, 0), 0.5);
  EXPECT_DOUBLE_EQ(RateAt(0.5, 0.5, 100, 4), 0.5 * 0.51);
  EXPECT_NEAR(RateAt(0.5, 0.25, 100, 4), 0.5 * (0.02 + 0.49 * (1 + std::numbers::sqrt2 / 2)), 1e-12);
  EXPECT_NEAR(RateAt(0.5, 1, 100, 4), 0.01, 1e-12);
}

}  // namespace
}  // namespace weft::learning
