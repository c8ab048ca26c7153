// Whether the left and right of a foreign motion are those of a person.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "figure/retarget.h"

namespace weft {

// The same with left and right exchanged, as a file needs whose person is mirrored or whose names are.
JointMatch WithSidesExchanged(const JointMatch& match);

// Forward is to the right of nobody's left side: knees bend backwards, toes point forwards, and the left arm
// is on the side of the left leg. InvalidArgument where knees and toes, or arms and legs, contradict; `notes`
// gets a sentence where one of knees and toes is not known and the other contradicts. Legs that never bend
// and feet without length tell nothing. Precondition: a pose, and what MatchJoints asks for is matched.
absl::Status CheckSides(const ForeignMotion& motion, const JointMatch& match,
                        std::vector<std::string>& notes);

}  // namespace weft
