// Motion capture on disk: BVH, the hierarchy and the channels of Biovision.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "figure/retarget.h"
#include "services/formats/figure/bvh_angles.h"

namespace weft {

// The largest BVH file that is read: half an hour of 30 joints at 120 poses a second.
inline constexpr uint64_t kMaxBvhBytes = uint64_t{256} << 20;

// Whether it begins as BVH does, a byte order mark aside.
bool IsBvh(std::string_view bytes);

// Reads what other importers read: keywords in any case, names with blanks, a byte order mark, any line ends,
// channels in any order and number at any joint, none at all. Ends of limbs are joints without a name that
// never turn. A joint's position channels are where it is against its parent, as Blender takes them; where
// they are zero at the joints of a skeleton with offsets, they are added to these. Scale channels must not
// change. Angles that are radians are known by their size (bvh_angles.h), and noted. More rows than the file
// says are read, and noted. InvalidArgument names source_name, line and what is wrong: no BVH, damaged, no
// motion, a second root, numbers with commas, no frame time, fewer rows than it says.
absl::StatusOr<ForeignMotion> ParseBvh(std::string_view bytes, const std::string& source_name,
                                       BvhAngles angles = BvhAngles::kAuto);
// Errors of ReadWholeFile besides.
absl::StatusOr<ForeignMotion> ReadBvh(const std::string& path, BvhAngles angles = BvhAngles::kAuto);

}  // namespace weft
