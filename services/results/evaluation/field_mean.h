// Means over frames, per vertex.
#pragma once

#include <vector>

namespace weft {

// Sums and counts per vertex; values that are not finite do not count.
class FieldMean {
 public:
  // `values`: [vertices], or empty.
  void Add(const std::vector<double>& values);
  // [vertices], times `scale`; NaN where no frame has a value.
  std::vector<double> Mean(double scale = 1) const;

 private:
  std::vector<double> sum_;
  std::vector<int> count_;
};

}  // namespace weft
