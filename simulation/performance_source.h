// What stands behind a Performance: one way of making frames.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "simulation/performance.h"

namespace weft {

class PerformanceSource {
 public:
  virtual ~PerformanceSource() = default;
  virtual const Garment& garment() const = 0;
  virtual const std::vector<Face>& body_faces() const = 0;
  // Called with 0, 1, 2 ... in order.
  virtual absl::StatusOr<PerformanceFrame> FrameAt(int frame) = 0;
};

}  // namespace weft
