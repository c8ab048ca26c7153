#include "tests/benchmark/logistic_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace weft::testing {
namespace {

// Outcomes of a model with the constant 1.5 and the weights 2 and -0.5; the second regressor is far from 0.
std::vector<std::pair<Eigen::VectorXd, bool>> Outcomes(int count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit;
  std::vector<std::pair<Eigen::VectorXd, bool>> outcomes;
  for (int k = 0; k < count; ++k) {
    const Eigen::VectorXd x = Eigen::Vector2d(normal(random), 10 + 3 * normal(random));
    const double odds = 1.5 + 2 * x[0] - 0.5 * x[1];
    outcomes.push_back({x, unit(random) < 1 / (1 + std::exp(-odds))});
  }
  return outcomes;
}

LogisticModel Fit(const std::vector<std::pair<Eigen::VectorXd, bool>>& outcomes, double ridge) {
  return FitLogistic(2, ridge, [&](const auto& add) {
    for (const auto& [x, came_true] : outcomes) add(x, came_true, 1);
  });
}

TEST(LogisticFit, FindsTheModelThatMadeTheOutcomes) {
  const LogisticModel model = Fit(Outcomes(40000), 0);
  EXPECT_NEAR(model.constant, 1.5, 0.15);
  EXPECT_NEAR(model.weights[0], 2, 0.06);
  EXPECT_NEAR(model.weights[1], -0.5, 0.015);
}

TEST(LogisticFit, IsWhereTheLikelihoodIsLargest) {
  const auto outcomes = Outcomes(2000);
  const auto log_likelihood = [&](const LogisticModel& model) {
    double sum = 0;
    for (const auto& [x, came_true] : outcomes)
      sum -= std::log1p(std::exp((came_true ? -1 : 1) * model.LogOdds(x)));
    return sum;
  };
  const LogisticModel best = Fit(outcomes, 0);
  for (const double change : {-0.02, 0.02}) {
    for (int k = 0; k < 3; ++k) {
      LogisticModel other = best;
      (k < 2 ? other.weights[k] : other.constant) += change;
      EXPECT_LT(log_likelihood(other), log_likelihood(best)) << k << " " << change;
    }
  }
}

TEST(LogisticFit, PriorKeepsWeightsSmallWhereOutcomesAreSeparable) {
  std::vector<std::pair<Eigen::VectorXd, bool>> outcomes;
  for (int k = -10; k <= 10; ++k) {
    if (k != 0) outcomes.push_back({Eigen::Vector2d(k, 1), k > 0});
  }
  const LogisticModel model = Fit(outcomes, 1);
  EXPECT_GT(model.weights[0], 0.1);
  EXPECT_LT(model.weights[0], 2);
  EXPECT_NEAR(model.weights[1], 0, 1e-6) << "a regressor that never changes says nothing";
  EXPECT_GT(Fit(outcomes, 0.1).weights[0], model.weights[0]);
}

TEST(LogisticFit, OutcomesCountAsOftenAsTheySay) {
  const auto outcomes = Outcomes(500);
  const LogisticModel twice = FitLogistic(2, 0, [&](const auto& add) {
    for (const auto& [x, came_true] : outcomes) {
      add(x, came_true, 1);
      if (x[0] > 0) add(x, came_true, 1);
    }
  });
  const LogisticModel weighted = FitLogistic(2, 0, [&](const auto& add) {
    for (const auto& [x, came_true] : outcomes) add(x, came_true, x[0] > 0 ? 2 : 1);
  });
  EXPECT_NEAR(weighted.constant, twice.constant, 1e-6);
  EXPECT_NEAR(weighted.weights[0], twice.weights[0], 1e-6);
  EXPECT_GT(std::abs(weighted.constant - Fit(outcomes, 0).constant), 1e-4);
}

}  // namespace
}  // namespace weft::testing
