// Whether the angles of a BVH file are degrees.
#pragma once

#include <string>
#include <vector>

#include "services/formats/figure/bvh_hierarchy.h"

namespace weft {

// BVH has degrees; some programs write radians. kAuto: as JudgeBvhAngles says.
enum class BvhAngles { kAuto, kDegrees, kRadians };

struct AngleJudgement {
  bool are_radians = false;
  std::string note;  // what is to be said where it is not certain, a sentence; else empty
};

// `values` [rows x hierarchy.numbers]. No angle of a file in radians is above 2 pi. A person who goes
// somewhere turns joints by more than that many degrees, so such angles are radians there. Where the person
// stays, they are degrees, with a note, unless joints would turn by more than joints do, or hardly at all.
AngleJudgement JudgeBvhAngles(const BvhHierarchy& hierarchy, const std::vector<double>& values);

}  // namespace weft
