#include "simulation/take_presets.h"

#include <array>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/nearest_word.h"
#include "simulation/random.h"

namespace weft {
namespace {

// A thin poplin: unlike a knit it does not give way, so that a small tube folds.
void SetUpPoplin(SyntheticTakeOptions& o) {
  o.performance.jersey.compression_share = 1;
  o.performance.jersey.bending_n_m = 8e-6;
}

void SetUpTiny(SyntheticTakeOptions& o) {
  o.performance.rows = 24, o.performance.cols = 48, o.performance.cell_mm = 3;
  o.performance.frames = 3;
  o.performance.settle_s = 0.3;
  SetUpPoplin(o);
  o.performance.handles.sway_mm = 2, o.performance.handles.compression = 0.06;
  o.rig.cameras = 12;
  o.rig.width_px = 192, o.rig.height_px = 256;
  o.rig.distance_mm = 800;
  o.rig.object_width_mm = 50, o.rig.object_height_mm = 72;
  o.camera.lens.point_spread_sigma_px = 0.6;
  o.look.light.rays = 32;
  o.look.room.floor_below_mm = 600;
}

void SetUpQuickstart(SyntheticTakeOptions& o) {
  o.performance.rows = 72, o.performance.cols = 120, o.performance.cell_mm = 3;
  o.performance.frames = 5;
  o.performance.handles.compression = 0.2;
  SetUpPoplin(o);
  o.rig.cameras = 16;
  o.rig.width_px = 600, o.rig.height_px = 800;
  o.rig.fill = 0.74;
  o.rig.object_width_mm = 150, o.rig.object_height_mm = 220;
}

// A camera as studios use: what differs between cameras, a short exposure, an aperture that must be wide.
void SetUpStudioCamera(SyntheticTakeOptions& o) {
  o.camera.lens.point_spread_sigma_px = 0.7, o.camera.lens.point_spread_variation = 0.15;
  o.camera.lens.f_number = 5.6, o.camera.lens.focus_error_mm = 30;
  o.camera.lens.vignetting = 0.1;
  o.camera.sensor.exposure_variation = 0.05, o.camera.sensor.color_variation = 0.02;
  o.shutter.exposure_ms = 2;
}

void SetUpTShirt24(SyntheticTakeOptions& o) {
  o.performance.garment = GarmentKind::kTShirt;
  o.performance.motion = PerformanceMotion::kTwistAndPinch;
  o.performance.cell_mm = 6;
  o.performance.frames = 200;
  o.rig.cameras = 24;
  o.rig.width_px = 1280, o.rig.height_px = 1024;
  o.rig.distance_mm = 2200;
  o.rig.elevation_deg = 25;
  o.rig.object_width_mm = 900, o.rig.object_height_mm = 720;
  o.rig.fill = 0.85;
  SetUpStudioCamera(o);
}

// A person in a skirt and a shirt that hangs over its waist.
void SetUpShirtAndSkirt(SyntheticTakeOptions& o) {
  SetUpTShirt24(o);
  o.performance.garment = GarmentKind::kShirtAndSkirt;
  o.performance.motion = PerformanceMotion::kTwist;
  o.performance.frames = 60;
  o.rig.object_height_mm = 900;
}

// A shirt that was captured before, worn again before two cameras that face each other.
void SetUpShirtDrive(SyntheticTakeOptions& o) {
  SetUpTShirt24(o);
  o.performance.motion = PerformanceMotion::kTwist;
  o.performance.frames = 100;
  o.rig.cameras = 2;
  o.rig.elevation_deg = 8;
}

// The same before cameras that nobody placed with care: 120 to 240 degrees between them.
void SetUpShirtDriveJitter(SyntheticTakeOptions& o) {
  SetUpShirtDrive(o);
  o.rig.around_variation_deg = 30, o.rig.elevation_variation_deg = 12;
  o.rig.focal_spread = 0.4;
}

// One vertex on every cell of the size that such studios print; the cameras are given.
void SetUpTShirtRig(SyntheticTakeOptions& o) {
  o.performance.garment = GarmentKind::kTShirt;
  o.performance.motion = PerformanceMotion::kTwistAndPinch;
  o.performance.cell_mm = 2.7;
  o.performance.frames = 1;
  o.crop_margin_mm = 100;
  SetUpStudioCamera(o);
}

// What the three presets of folds have in common: cells of 3 to 5 px, some of them smeared by the motion.
void SetUpFolds(SyntheticTakeOptions& o) {
  o.performance.cell_mm = 4;
  o.performance.frames = 6;
  o.performance.settle_s = 1.2;
  o.performance.handles.period_s = 0.9;
  o.rig.cameras = 16;
  SetUpStudioCamera(o);
  o.shutter.exposure_ms = 5;
}

// A skirt in motion on legs.
void SetUpSwungSkirt(SyntheticTakeOptions& o, GarmentKind kind, int rows, int cols) {
  SetUpFolds(o);
  o.performance.garment = kind;
  o.performance.rows = rows, o.performance.cols = cols;
  o.performance.handles.twist_deg = 28, o.performance.handles.sway_mm = 10;
  SetUpPoplin(o);
  o.rig.width_px = 400, o.rig.height_px = 400;
  o.rig.object_width_mm = 260, o.rig.object_height_mm = 260;
}

void SetUpPleats(SyntheticTakeOptions& o) { SetUpSwungSkirt(o, GarmentKind::kPleatedSkirt, 56, 240); }

// Thin cloth, so that its folds are small.
void SetUpGathers(SyntheticTakeOptions& o) {
  SetUpSwungSkirt(o, GarmentKind::kGatheredSkirt, 40, 288);
  o.performance.handles.compression = 0.62;
  o.performance.jersey.bending_n_m = 2e-6;
}

void SetUpCurls(SyntheticTakeOptions& o) {
  SetUpFolds(o);
  o.performance.garment = GarmentKind::kCurlingSheet;
  o.performance.rows = 72, o.performance.cols = 84;
  o.performance.handles.twist_deg = 18, o.performance.handles.sway_mm = 30;
  o.performance.handles.compression = 0.06;
  o.rig.width_px = 440, o.rig.height_px = 440;
  o.rig.object_width_mm = 330, o.rig.object_height_mm = 330;
}

struct Preset {
  const char* name;
  const char* about;
  void (*set_up)(SyntheticTakeOptions&);
};
constexpr std::array kPresets = {
    Preset{"tiny", "a small tube before 12 cameras, 3 frames; seconds", SetUpTiny},
    Preset{"quickstart", "a tube with folds before 16 cameras, 5 frames; half a minute", SetUpQuickstart},
    Preset{"tshirt-24",
           "a T-shirt of 19,000 cells, worn, twisted and pulled, before 24 cameras, 200 frames; about an "
           "hour on two cores",
           SetUpTShirt24},
    Preset{"shirt-and-skirt",
           "a person in a skirt and a shirt over it, two boards, before 24 cameras, 60 frames; half an hour",
           SetUpShirtAndSkirt},
    Preset{"shirt-drive",
           "the same T-shirt before two cameras that face each other, 100 frames; --cameras for more of them",
           SetUpShirtDrive},
    Preset{"shirt-drive-jitter",
           "the same with 120 to 240 degrees between the cameras, other heights and lenses",
           SetUpShirtDriveJitter},
    Preset{"pleats",
           "a skirt with pressed pleats, swung, before 16 cameras, 3 to 5 px a cell, 6 frames; a minute",
           SetUpPleats},
    Preset{"gathers",
           "a skirt gathered at its waist, swung, before 16 cameras, 3 to 5 px a cell, 6 frames; a minute",
           SetUpGathers},
    Preset{
        "curls",
        "strips of jersey with curling hems, shaken, before 16 cameras, 3 to 5 px a cell, 6 frames; a minute",
        SetUpCurls},
    Preset{"tshirt-rig", "a T-shirt of 96,000 cells, worn, before the cameras of --rig, cropped to it; hours",
           SetUpTShirtRig},
};

}  // namespace

std::vector<TakePreset> TakePresets() {
  std::vector<TakePreset> out;
  for (const Preset& p : kPresets) out.push_back({p.name, p.about});
  return out;
}

absl::StatusOr<SyntheticTakeOptions> SyntheticPreset(std::string_view name, uint64_t seed) {
  std::vector<std::string> names;
  for (const Preset& preset : kPresets) {
    names.emplace_back(preset.name);
    if (name != preset.name) continue;
    SyntheticTakeOptions o;
    preset.set_up(o);
    o.name = absl::StrCat("synthetic-", preset.name, "-", seed);
    o.seed = KeyOf(seed, "board");
    o.performance.seed = KeyOf(seed, "motion");
    o.rig.seed = KeyOf(seed, "rig");
    o.look.inks.seed = KeyOf(seed, "inks");
    o.look.fabric.seed = KeyOf(seed, "fabric");
    o.look.skin.seed = KeyOf(seed, "skin");
    o.look.room.seed = KeyOf(seed, "backdrop");
    o.camera.sensor.seed = KeyOf(seed, "sensor");
    return o;
  }
  return absl::InvalidArgumentError(absl::StrCat("preset \"", std::string(name), "\" is none of ",
                                                 absl::StrJoin(names, ", "), DidYouMean(name, names)));
}

}  // namespace weft
