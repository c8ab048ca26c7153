// The part HIERARCHY of a BVH file.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "figure/retarget.h"
#include "services/formats/figure/bvh_text.h"

namespace weft {

enum class BvhChannel {
  kXPosition,
  kYPosition,
  kZPosition,
  kXRotation,
  kYRotation,
  kZRotation,
  kXScale,
  kYScale,
  kZScale
};

struct BvhHierarchy {
  std::vector<ForeignMotion::Joint> joints;       // depth first; `place` is not yet set
  std::vector<std::vector<BvhChannel>> channels;  // of each joint, in the order of a row's numbers
  std::vector<std::string> notes;                 // what was read otherwise than the file says
  size_t numbers = 0;                             // in a row
};

// Up to the word MOTION, which is taken, or the end. InvalidArgument names the line.
absl::StatusOr<BvhHierarchy> ReadBvhHierarchy(BvhText& text);

}  // namespace weft
