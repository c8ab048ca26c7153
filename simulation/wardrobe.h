// The garments that a body wears: patterns, and how they are put on.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "figure/body.h"
#include "simulation/garment_pattern.h"

namespace weft {

// A sewn garment before it is worn: spread around a body that is still thin.
struct Outfit {
  SewnPanels sewn;
  std::vector<Eigen::Vector3d> start_mm;  // [vertices], relative to the pelvis; free of self-intersections
  std::vector<int> waist;                 // vertices that sit on the pelvis (skirt)
};

// How a T-shirt ends, [mm]: its length from the neck, half of the width at its hem, and whether it is open
// there when put on, for what is worn below it, or flat.
struct ShirtCut {
  double length = 680, hem = 236;
  bool open = false;
};

// Five panels: front, back, two sleeves, collar band; half chest 480 mm, length 680 mm. 96,000 cells of
// 2.7 mm, 19,000 of 6 mm. The coarsest cell is about 20 mm.
std::vector<Panel> TShirtPanels(double cell_mm, const ShirtCut& cut = {});
absl::StatusOr<Outfit> MakeTShirt(double cell_mm, const ShirtCut& cut = {});

// Front and back, flared; 480 mm long.
std::vector<Panel> SkirtPanels();
absl::StatusOr<Outfit> MakeSkirt(double cell_mm);

// How a body stands when a garment is put on (arms well away), and in the garment's natural pose.
BodyPose DressingPose();
BodyPose NaturalPose();
inline constexpr double kDressingGrowth = 0.25;  // of the body at the start

}  // namespace weft
