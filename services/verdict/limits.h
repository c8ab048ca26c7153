// Every limit of every verdict. docs/verdicts.md shows the same table, and a test compares the two.
#pragma once

#include <array>

#include "absl/strings/string_view.h"

namespace weft {

enum class Better { kMore, kLess };

// A value that is at least (kMore) or at most (kLess) `good` is good, one that reaches `usable` is usable,
// anything else is bad. NaN is bad.
struct Limit {
  absl::string_view id;    // "take.complete_sets"
  absl::string_view name;  // as operators say it
  absl::string_view unit;  // "%", "ms", "px"; empty for counts
  double good;
  double usable;
  Better better;
  int decimals;              // of the value as it is printed
  absl::string_view remedy;  // one sentence: what to do where the value falls short
};

// Recorded takes.
inline constexpr Limit kTakeCompleteSets{
    "take.complete_sets",
    "frame sets with all cameras",
    "%",
    99,
    90,
    Better::kMore,
    1,
    "Run `weft take sync` to see which camera lacks frames and why, mend that, and record again."};

// Images and registrations.
inline constexpr Limit kDecodeCells{
    "decode.cells",
    "cells decoded in an image, mean",
    "",
    20,
    2,
    Better::kMore,
    1,
    "Check that --board is the printed board of this cloth, and that images are sharp and light enough."};
inline constexpr Limit kRegisterRaysMeet{
    "register.rays_meet",
    "cells and corners at which the cameras' rays meet",
    "%",
    90,
    70,
    Better::kMore,
    1,
    "Check that --rig is the calibration of this take; `weft rig refine` corrects cameras that moved since."};
inline constexpr Limit kRegisterOnTemplate{
    "register.on_template",
    "triangulated cells that the template has",
    "%",
    50,
    0,
    Better::kMore,
    1,
    "Check that --template is that of this garment, not of another part of the same board."};
inline constexpr Limit kRegisterFrames{
    "register.frames",
    "frames registered",
    "%",
    100,
    90,
    Better::kMore,
    1,
    "See the reasons in the table of frames of report.html, mend them, and run the same command again."};
inline constexpr Limit kRegisterImages{
    "register.images",
    "images that could be used",
    "%",
    99,
    50,
    Better::kMore,
    1,
    "See in the table of cameras of report.html which lack images, and why."};
inline constexpr Limit kRegisterCoverage{
    "register.coverage",
    "cells of the garment that were observed",
    "%",
    60,
    20,
    Better::kMore,
    1,
    "Add cameras where the cloth is not seen: `weft rig plan` tells which; see report.html for where."};

// In the order of docs/verdicts.md.
inline constexpr std::array kLimits = {&kTakeCompleteSets,   &kDecodeCells,    &kRegisterRaysMeet,
                                       &kRegisterOnTemplate, &kRegisterFrames, &kRegisterImages,
                                       &kRegisterCoverage};

}  // namespace weft
