// Motion capture on disk: BVH, the hierarchy and the channels of Biovision.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "figure/retarget.h"

namespace weft {

// The largest BVH file that is read: half an hour of 30 joints at 120 poses a second.
inline constexpr uint64_t kMaxBvhBytes = uint64_t{256} << 20;

// Read by the Open Asset Import Library. Ends of limbs are joints that never turn. Angles to single
// precision. InvalidArgument names source_name and what is wrong: no BVH, damaged, no motion, two joints of
// one name, more than 100 joints in a chain.
absl::StatusOr<ForeignMotion> ParseBvh(std::string_view bytes, const std::string& source_name);
// Errors of ReadWholeFile besides.
absl::StatusOr<ForeignMotion> ReadBvh(const std::string& path);

}  // namespace weft
