#include "tests/benchmark/logistic_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace weft::testing {
namespace {

// Mean and standard deviation of each regressor.
struct Scale {
  Eigen::VectorXd mean, deviation;

  Scale(int regressors, const ForEachOutcome& for_each) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(regressors), squares = sum;
    double count = 0;
    for_each([&](const Eigen::VectorXd& x, bool, double counts) {
      sum += counts * x;
      squares += counts * x.cwiseAbs2();
      count += counts;
    });
    constexpr double kLeastVariance = 1e-12;
    mean = sum / std::max(count, 1.0);
    deviation = (squares / std::max(count, 1.0) - mean.cwiseAbs2()).cwiseMax(kLeastVariance).cwiseSqrt();
  }
};

}  // namespace

LogisticModel FitLogistic(int regressors, double ridge, const ForEachOutcome& for_each) {
  constexpr int kMostSteps = 50;
  constexpr double kLongestStep = 2, kShortestStep = 1e-6;
  const Scale scale(regressors, for_each);
  const int unknowns = regressors + 1;  // the constant comes last
  Eigen::VectorXd solved = Eigen::VectorXd::Zero(unknowns),
                  prior = Eigen::VectorXd::Constant(unknowns, ridge);
  prior[regressors] = 0;
  for (int step = 0; step < kMostSteps; ++step) {
    Eigen::MatrixXd normal = prior.asDiagonal();
    Eigen::VectorXd slope = -prior.cwiseProduct(solved), z(unknowns);
    for_each([&](const Eigen::VectorXd& x, bool came_true, double counts) {
      z.head(regressors) = (x - scale.mean).cwiseQuotient(scale.deviation);
      z[regressors] = 1;
      const double p = 1 / (1 + std::exp(-solved.dot(z)));
      normal.selfadjointView<Eigen::Lower>().rankUpdate(z, counts * p * (1 - p));
      slope += counts * ((came_true ? 1 : 0) - p) * z;
    });
    const Eigen::VectorXd change = normal.selfadjointView<Eigen::Lower>().ldlt().solve(slope);
    const double longest = change.cwiseAbs().maxCoeff();
    solved += std::min(1.0, kLongestStep / longest) * change;
    if (longest < kShortestStep) break;
  }
  LogisticModel model;
  model.weights = solved.head(regressors).cwiseQuotient(scale.deviation);
  model.constant = solved[regressors] - model.weights.dot(scale.mean);
  return model;
}

}  // namespace weft::testing
