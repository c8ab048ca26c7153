#include "simulation/synthetic_take.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "simulation/random.h"

namespace weft {
namespace {

// A small tube with folds before 12 cameras, just large enough to be decoded and registered.
void SetUpTiny(SyntheticTakeOptions& o) {
  o.cloth.rows = 24, o.cloth.cols = 48, o.cloth.cell_mm = 3;
  o.motion.frames = 3;
  o.motion.step_s = 1.0 / 10000;
  o.motion.settle_s = 0.3;
  o.motion.sway_mm = 2, o.motion.compression = 0.06;
  o.rig.cameras = 12;
  o.rig.width_px = 192, o.rig.height_px = 256;
  o.rig.distance_mm = 800;
  o.rig.object_width_mm = 50, o.rig.object_height_mm = 72;
  o.sensor.point_spread_sigma_px = 0.6;
  o.look.light.rays = 32;
}

void SetUpQuickstart(SyntheticTakeOptions& o) {
  o.cloth.rows = 72, o.cloth.cols = 120, o.cloth.cell_mm = 3;
  o.motion.frames = 5;
  o.motion.step_s = 1.0 / 8000;
  o.rig.cameras = 16;
  o.rig.width_px = 600, o.rig.height_px = 800;
  o.rig.fill = 0.74;
  o.motion.compression = 0.13;
  o.sensor.point_spread_sigma_px = 1.0;
  o.rig.object_width_mm = 150, o.rig.object_height_mm = 220;
}

}  // namespace

std::vector<std::string> SyntheticPresetNames() { return {"tiny", "quickstart"}; }

absl::StatusOr<SyntheticTakeOptions> SyntheticPreset(std::string_view name, uint64_t seed) {
  SyntheticTakeOptions o;
  if (name == "tiny") {
    SetUpTiny(o);
  } else if (name == "quickstart") {
    SetUpQuickstart(o);
  } else {
    return absl::InvalidArgumentError(absl::StrCat("preset \"", std::string(name), "\" is none of ",
                                                   absl::StrJoin(SyntheticPresetNames(), ", ")));
  }
  o.name = absl::StrCat("synthetic-", std::string(name), "-", seed);
  o.seed = KeyOf(seed, "board");
  o.motion.seed = KeyOf(seed, "motion");
  o.rig.seed = KeyOf(seed, "rig");
  o.look.inks.seed = KeyOf(seed, "inks");
  o.look.backdrop.seed = KeyOf(seed, "backdrop");
  o.sensor.seed = KeyOf(seed, "sensor");
  return o;
}

absl::Status SyntheticTakeOptions::Validate() const {
  absl::Status status = cloth.Validate();
  status.Update(motion.Validate());
  status.Update(rig.Validate());
  status.Update(look.Validate());
  status.Update(sensor.Validate());
  return status;
}

absl::StatusOr<SyntheticTake> SyntheticTake::Make(const SyntheticTakeOptions& options,
                                                  const std::function<void(int)>& on_frame) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  const ClothOptions& c = options.cloth;
  absl::StatusOr<Board> board =
      GenerateBoard(c.first_row + c.rows, c.first_col + c.cols, c.cell_mm, options.seed);
  if (!board.ok()) return board.status();
  board->id = options.name;
  absl::StatusOr<Rig> rig = MakeStudioRig(options.name, options.rig);
  if (!rig.ok()) return rig.status();
  absl::StatusOr<Cloth> cloth = BuildCloth(c);
  if (!cloth.ok()) return cloth.status();
  absl::StatusOr<Template> garment = ImportTemplate(options.name, cloth->rest, cloth->cell_of_vertex, *board);
  if (!garment.ok()) return garment.status();
  auto positions = SimulateMotion(*cloth, options.motion, on_frame);
  if (!positions.ok()) return positions.status();

  SyntheticTake take(std::move(cloth->print));
  take.options_ = options;
  take.board_ = *std::move(board);
  take.rig_ = *std::move(rig);
  take.garment_ = *std::move(garment);
  take.positions_mm_ = *std::move(positions);
  return take;
}

TriangleMesh SyntheticTake::MeshAt(int frame) const { return {positions_mm_[frame], garment_.rest.faces}; }

absl::StatusOr<StudioScene> SyntheticTake::SceneAt(int frame) const {
  return StudioScene::Build(MeshAt(frame), print_, board_, options_.look);
}

absl::StatusOr<Frame> SyntheticTake::Render(const StudioScene& scene, int frame, int camera) const {
  return RenderView(scene, rig_.cameras[camera], options_.sensor, frame);
}

ViewTruth SyntheticTake::Truth(const StudioScene& scene, int camera) const {
  return FindViewTruth(scene.mesh(), locator_, scene.rays(), rig_.cameras[camera]);
}

}  // namespace weft
