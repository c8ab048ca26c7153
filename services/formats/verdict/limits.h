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

constexpr Limit AtLeast(absl::string_view id, absl::string_view name, absl::string_view unit, double good,
                        double usable, int decimals, absl::string_view remedy) {
  return {id, name, unit, good, usable, Better::kMore, decimals, remedy};
}
constexpr Limit AtMost(absl::string_view id, absl::string_view name, absl::string_view unit, double good,
                       double usable, int decimals, absl::string_view remedy) {
  return {id, name, unit, good, usable, Better::kLess, decimals, remedy};
}

// Recorded takes.
inline constexpr Limit kTakeCompleteSets =
    AtLeast("take.complete_sets", "frame sets with all cameras", "%", 99, 90, 1,
            "Run `weft take sync` to see which camera lacks frames and why, fix that, and record again.");

inline constexpr Limit kSyncSpread =
    AtMost("sync.spread", "time between the cameras of a frame set, median", "ms", 1, 10, 3,
           "Trigger the cameras together, or put them on PTP, and record again.");

// Images and registrations.
inline constexpr Limit kDecodeCells = AtLeast(
    "decode.cells", "cells decoded in an image, mean", "", 20, 2, 1,
    "Check that --board is the printed board of this cloth, and that images are sharp and light enough.");
// Pictures of `weft simulate --preset quickstart` made darker, as `accuracy_decode --darker N TAKE` does
// (November 2026): the median error of centres rises by 3 % at 40 levels, by 12 % at 14 and by a third at 7,
// where 5 % of the cells are lost, too.
inline constexpr Limit kDecodeGreyLevels = AtLeast(
    "decode.grey_levels", "grey levels that the print spans, of the darkest camera", "", 32, 8, 0,
    "Raise exposure time, light or gain, or deliver more bits (Mono12, BayerRG12), and record again.");
inline constexpr Limit kRegisterRaysMeet =
    AtLeast("register.rays_meet", "cells and corners at which the cameras' rays meet", "%", 90, 70, 1,
            "Check that --rig is the calibration of this take, in mm; `weft rig refine` corrects cameras "
            "that moved since.");
inline constexpr Limit kRegisterCamerasKnown =
    AtLeast("register.cameras_known", "cameras of the recording that the rig has", "%", 100, 50, 1,
            "Register with the rig of this take; calibrate one of all of its cameras.");
inline constexpr Limit kRegisterCamerasAgree =
    AtLeast("register.cameras_agree", "cameras that agree with the others", "%", 100, 75, 1,
            "Check that each camera stands where the rig says and that its images are its own.");
// As calibration.uncertainty. Right takes: see the last line of `accuracy_cameras`. Of the preset tiny right
// cameras have 0.01 px, and 0.31 px where every other one is a frame late (November 2026).
inline constexpr Limit kRegisterOffset =
    AtMost("register.offset", "offset that cells near each other share, of most cameras", "px", 0.2, 2, 2,
           "See whether all cameras are in time (`weft take sync`), and whether the rig is the one of this "
           "take; else calibrate again.");
inline constexpr Limit kRegisterCamerasSee =
    AtLeast("register.cameras_see", "cameras that see the cloth that faces them", "%", 100, 75, 1,
            "Look at the images: is the cap on, are they dark, out of focus, mirrored, of another moment?");
inline constexpr Limit kRegisterImagesSee = AtLeast(
    "register.images_see", "images that show the cloth that faces their camera", "%", 100, 50, 1,
    "Look at these images: are they black, too bright, damaged, or did somebody stand before the camera?");
inline constexpr Limit kRegisterImagesNew =
    AtLeast("register.images_new", "images that are not those of the frame before", "%", 100, 50, 1,
            "A camera or its driver repeats pictures: start it anew and record again.");
inline constexpr Limit kRegisterLens =
    AtMost("register.lens", "focal lengths off, by the perspective of the cloth", "%", 2, 10, 1,
           "Calibrate again with the lenses as they are, or register with the rig of this take.");
inline constexpr Limit kRegisterScale =
    AtMost("register.scale", "cloth larger or smaller than its print", "%", 2.5, 10, 2,
           "Measure ten cells with a ruler: compare with cell_mm of the board, and the cameras' distances "
           "with the rig.");
inline constexpr Limit kRegisterOnTemplate =
    AtLeast("register.on_template", "triangulated cells that the template has", "%", 50, 0, 1,
            "Check that --template is that of this garment, not of another part of the same board.");
inline constexpr Limit kRegisterFrames = AtLeast(
    "register.frames", "frames registered", "%", 100, 90, 1,
    "See the reasons in the table of frames of report.html, fix them, and run the same command again.");
inline constexpr Limit kRegisterImages =
    AtLeast("register.images", "images that could be used", "%", 99, 50, 1,
            "See in the table of cameras of report.html which lack images, and why.");
inline constexpr Limit kRegisterScanDistance = AtMost(
    "register.scan_distance", "distance of scans from the cloth, median", "mm", 1.5, 6, 2,
    "Check that each scan is of its frame's moment, in the rig's world, and of the outside of the cloth.");
inline constexpr Limit kRegisterScanPoints =
    AtLeast("register.scan_points", "points of scans that found the cloth", "%", 1, 0, 1,
            "Check that --scans are in mm, in the world of the rig, and of this take.");
inline constexpr Limit kRegisterCoverage = AtLeast(
    "register.coverage", "cells of the garment that were observed", "%", 60, 20, 1,
    "Add cameras where the cloth is not seen: `weft rig plan` selects them; report.html shows where.");

// Evaluations.
inline constexpr Limit kEvaluateFrames =
    AtLeast("evaluate.frames", "frames with a mesh", "%", 100, 90, 1,
            "See in the report of the job why the others have none, fix that, and register them again.");
inline constexpr Limit kEvaluateCoverage =
    AtLeast("evaluate.coverage", "cells seen by 3 cameras or more", "%", 75, 50, 1,
            "Add cameras where the map of visibility is dark: `weft rig plan` selects them.");
inline constexpr Limit kEvaluatePrecision =
    AtLeast("evaluate.precision", "decoded cells that are right", "%", 99.5, 98, 2,
            "Check that board and rig are those of the take; give the cells more pixels and light.");
inline constexpr Limit kEvaluateVertexError =
    AtMost("evaluate.vertex_error", "vertex error where 3 cameras or more see, mean", "mm", 0.5, 1.5, 3,
           "Check the calibration of the rig; see on the map of vertex errors where they are.");
inline constexpr Limit kEvaluateDrift =
    AtMost("evaluate.drift", "drift of observed vertices, mean", "mm/s", 3, 15, 2,
           "See on the map of drift where the mesh slides; add cameras or light there.");
inline constexpr Limit kEvaluateDistortion = AtMost(
    "evaluate.distortion", "geodesic distortion", "%", 3, 6, 2,
    "Check that the template is that of the garment: `weft template build` makes it from a recording.");
inline constexpr Limit kEvaluateSelfIntersections =
    AtMost("evaluate.self_intersections", "pairs of faces that intersect, a frame", "", 0, 20, 1,
           "Check these frames before they are used; register them again with neighbours on both sides.");
inline constexpr Limit kEvaluateLeftOut =
    AtMost("evaluate.left_out", "error of a camera that is left out, mean", "px", 0.5, 1.5, 3,
           "A camera that moved shows a shift in the table of cameras: correct it with `weft rig refine`.");

// Calibrated rigs.
inline constexpr Limit kCalibrationReprojection =
    AtMost("calibration.reprojection", "reprojection error", "px", 0.3, 1, 3,
           "See in the report which cameras are worst; shorter exposures and a flatter board lower it.");
inline constexpr Limit kCalibrationUncertainty =
    AtMost("calibration.uncertainty", "projection uncertainty of the worst camera", "px", 0.2, 0.5, 3,
           "Show that camera more boards, near and far, tilted, and into the corners of its image.");
inline constexpr Limit kPlanCoverage =
    AtLeast("plan.coverage", "cells covered by the selected cameras", "%", 75, 50, 1,
            "Choose more cameras (--cameras), or add candidates where the map of views is dark.");

// Templates.
inline constexpr Limit kTemplateScale = AtMost(
    "template.scale", "length of edges off the print, median or along an axis", "%", 1, 5, 1,
    "Check that --board has the printed size of the cells, and import the mesh in its own size, in mm.");
inline constexpr Limit kTemplateStrain =
    AtMost("template.strain", "edges off the print, 95 of 100", "%", 5, 15, 1,
           "See in the report where; build from frames that show that part without folds.");

// In the order of docs/verdicts.md.
inline constexpr std::array kLimits = {
    &kTakeCompleteSets,
    &kSyncSpread,
    &kDecodeCells,
    &kDecodeGreyLevels,
    &kRegisterRaysMeet,
    &kRegisterCamerasKnown,
    &kRegisterCamerasAgree,
    &kRegisterOffset,
    &kRegisterCamerasSee,
    &kRegisterImagesSee,
    &kRegisterImagesNew,
    &kRegisterLens,
    &kRegisterScale,
    &kRegisterOnTemplate,
    &kRegisterFrames,
    &kRegisterImages,
    &kRegisterScanPoints,
    &kRegisterScanDistance,
    &kRegisterCoverage,
    &kEvaluateFrames,
    &kEvaluateCoverage,
    &kEvaluatePrecision,
    &kEvaluateVertexError,
    &kEvaluateDrift,
    &kEvaluateDistortion,
    &kEvaluateSelfIntersections,
    &kEvaluateLeftOut,
    &kCalibrationReprojection,
    &kCalibrationUncertainty,
    &kPlanCoverage,
    &kTemplateScale,
    &kTemplateStrain,
};

}  // namespace weft
