#include "services/results/evaluation/field_mean.h"

#include <cmath>
#include <limits>

namespace weft {

void FieldMean::Add(const std::vector<double>& values) {
  if (sum_.size() < values.size()) sum_.resize(values.size()), count_.resize(values.size());
  for (size_t v = 0; v < values.size(); ++v)
    if (std::isfinite(values[v])) sum_[v] += values[v], ++count_[v];
}

std::vector<double> FieldMean::Mean(double scale) const {
  std::vector<double> mean(sum_.size(), std::numeric_limits<double>::quiet_NaN());
  for (size_t v = 0; v < sum_.size(); ++v)
    if (count_[v] > 0) mean[v] = scale * sum_[v] / count_[v];
  return mean;
}

}  // namespace weft
