// Motions on disk: a `.motion` file (layout: docs/file-formats.md).
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "figure/motion.h"

namespace weft {

// The largest motion file that is read: some ten hours at 60 poses a second.
inline constexpr uint64_t kMaxMotionBytes = uint64_t{1} << 30;

// Positions and quaternions as 32-bit floats.
std::string EncodeMotion(const Motion& motion);
// InvalidArgument names source_name and what is wrong: not a motion, of another skeleton, cut off, damaged.
absl::StatusOr<Motion> DecodeMotion(std::string_view bytes, const std::string& source_name);

// The same on files: errors of ReadWholeFile and WriteFileAtomically besides.
absl::StatusOr<Motion> ReadMotion(const std::string& path);
absl::Status WriteMotion(const std::string& path, const Motion& motion);

// 16 hex digits over what the file holds.
std::string MotionHash(const Motion& motion);

}  // namespace weft
