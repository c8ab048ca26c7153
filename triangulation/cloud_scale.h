// How large the cloud is against a known pattern.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "triangulation/cloud.h"

namespace weft {

// Distance of the centres of two neighbouring cells, mm; empty where it is not known.
using CellDistance = std::function<std::optional<double>(const BoardNode&, const BoardNode&)>;

// Distances between centres that are next to each other in the cloud, over those of the pattern. They are
// measured along the line through the centres before and behind, which a bend leaves parallel. Plain
// distances d grow by noise across them, of sigma s a point by 2 s^2 / d; these shrink by 2 s^2 / (9 d).
// Geometric mean of the medians along rows and along columns: cloth that is drawn in one direction narrows in
// the other. Looks at 1,000 distances each. Empty where fewer than 50 of a direction are known.
std::optional<double> MeasureCloudScale(const Cloud& cloud, const CellDistance& pattern_mm);

}  // namespace weft
