// Logistic regression.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace weft::testing {

struct LogisticModel {
  double constant = 0;
  Eigen::VectorXd weights;

  double LogOdds(const Eigen::VectorXd& regressors) const { return constant + weights.dot(regressors); }
};

// Calls its argument with the regressors of each observation, whether it came true, and how much it counts.
using ForEachOutcome = std::function<void(const std::function<void(const Eigen::VectorXd&, bool, double)>&)>;

// Maximum of the likelihood, by Newton's method; all observations are gone through once a step. `ridge` is
// the precision of a Gaussian prior on the weights, of regressors with unit variance; the constant has none.
LogisticModel FitLogistic(int regressors, double ridge, const ForEachOutcome& for_each);

}  // namespace weft::testing
