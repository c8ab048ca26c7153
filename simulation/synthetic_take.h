// A whole synthetic recording: board, garment, rig, motion and how it is filmed. Read this header first.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/frame.h"
#include "capture/rig.h"
#include "pattern/board.h"
#include "simulation/cloth.h"
#include "simulation/cloth_motion.h"
#include "simulation/printed_mesh.h"
#include "simulation/renderer.h"
#include "simulation/studio_rig.h"
#include "simulation/studio_scene.h"
#include "simulation/view_truth.h"

namespace weft {

struct SyntheticTakeOptions {
  std::string name = "synthetic";  // part of the ids of board, rig and template
  uint64_t seed = 1;               // of the board; the parts below have seeds of their own
  ClothOptions cloth;
  MotionOptions motion;
  StudioRigOptions rig;
  StudioOptions look;
  SensorOptions sensor;

  absl::Status Validate() const;
};

// "tiny" (for tests: two seconds of work), "quickstart" (a tube with folds before 16 cameras).
std::vector<std::string> SyntheticPresetNames();
// Every part's seed follows from `seed`. InvalidArgument lists the names there are.
absl::StatusOr<SyntheticTakeOptions> SyntheticPreset(std::string_view name, uint64_t seed);

// Everything but the pictures, which are made one at a time.
class SyntheticTake {
 public:
  // Simulates the motion; `on_frame` (may be empty) is called with the number of frames done. Deterministic.
  // Errors of the options, GenerateBoard and SimulateMotion.
  static absl::StatusOr<SyntheticTake> Make(const SyntheticTakeOptions& options,
                                            const std::function<void(int)>& on_frame = {});

  const SyntheticTakeOptions& options() const { return options_; }
  const Board& board() const { return board_; }
  const Rig& rig() const { return rig_; }
  const Template& garment() const { return garment_; }
  int frames() const { return static_cast<int>(positions_mm_.size()); }

  // The true mesh of a frame, vertices in the template's order.
  TriangleMesh MeshAt(int frame) const;
  // The lit scene of a frame; casts its light in the calling thread's TBB arena.
  absl::StatusOr<StudioScene> SceneAt(int frame) const;
  // What camera `camera` of the rig takes of the scene at `frame`.
  absl::StatusOr<Frame> Render(const StudioScene& scene, int frame, int camera) const;
  ViewTruth Truth(const StudioScene& scene, int camera) const;

 private:
  explicit SyntheticTake(ClothPrint print) : print_(std::move(print)), locator_(print_) {}

  SyntheticTakeOptions options_;
  Board board_;
  Rig rig_;
  Template garment_;
  ClothPrint print_;
  PrintLocator locator_;
  std::vector<std::vector<Eigen::Vector3d>> positions_mm_;  // [frames][vertices]
};

}  // namespace weft
