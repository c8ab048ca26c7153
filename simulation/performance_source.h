// What stands behind a Performance: one way of making frames.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "simulation/performance.h"

namespace weft {

// How many equal steps of `longest_s` at most make up a span of time; rounding errors are no span.
inline int StepsWithin(double span_s, double longest_s) {
  return static_cast<int>(std::ceil(span_s / longest_s - 1e-9));
}

// The options' step; an automatic one is short enough for cloth of that speed to be kept apart.
inline double StepOf(const PerformanceOptions& o, double fastest_mm_s) {
  if (o.step_s > 0) return o.step_s;
  return std::min(0.002, 0.5 * o.cell_mm / fastest_mm_s);
}

class PerformanceSource {
 public:
  virtual ~PerformanceSource() = default;
  virtual const Garment& garment() const = 0;
  virtual const std::vector<Face>& body_faces() const = 0;
  // Called with 0, 1, 2 ... in order.
  virtual absl::StatusOr<PerformanceFrame> FrameAt(int frame) = 0;
  // Of all that later frames depend on; empty where that is not offered.
  virtual std::string SaveState() { return {}; }
};

}  // namespace weft
