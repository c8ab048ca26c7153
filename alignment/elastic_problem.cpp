#include "alignment/elastic_problem.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace weft {

void ElasticProblem::Add(int vertex, const Eigen::Vector3d& target_mm, const Eigen::Matrix3d& weight) {
  const Eigen::Matrix3d sum = weights[vertex] + weight;
  const Eigen::Vector3d shift = weight * (target_mm - targets_mm[vertex]);
  targets_mm[vertex] += sum.ldlt().solve(shift);
  weights[vertex] = sum;
}

absl::Status ElasticOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(absl::StrCat("elastic.", what));
  };
  if (!(lambda > 0) || !std::isfinite(lambda)) return bad("lambda must be a positive number");
  if (!(distortion.stretch > 0)) return bad("distortion.stretch must be positive");
  if (!(distortion.bending >= 0)) return bad("distortion.bending must not be negative");
  if (!(tolerance > 0)) return bad("tolerance must be positive");
  if (max_iterations < 1) return bad("max_iterations must be at least 1");
  return absl::OkStatus();
}

}  // namespace weft
