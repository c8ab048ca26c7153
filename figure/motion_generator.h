// Motions without a recording.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "figure/motion.h"

namespace weft {

enum class MotionKind { kStanding, kTwist, kJogging, kWalk, kWave, kSpline, kMixed, kSquat, kReach };

struct MotionKindInfo {
  MotionKind kind;
  std::string_view name;   // "standing", ...
  std::string_view about;  // half a sentence
};
std::span<const MotionKindInfo> MotionKinds();
std::string_view NameOf(MotionKind kind);
// InvalidArgument lists the names there are.
absl::StatusOr<MotionKind> MotionKindNamed(std::string_view name);

struct MotionOptions {
  MotionKind kind = MotionKind::kMixed;
  double seconds = 10;
  double fps = 60;
  uint64_t seed = 1;  // of phases, sizes, order

  absl::Status Validate() const;
};

// Joints stay within their limits (LimitOf), arms 12 mm clear of an average trunk, the lower foot on the
// ground but for jogging. kMixed never holds kSquat or kReach, so that these can be kept for tests. The same
// options give the same bytes on one platform. Errors of Validate.
absl::StatusOr<Motion> MakeMotion(const MotionOptions& options);

}  // namespace weft
