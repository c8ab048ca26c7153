// A whole synthetic recording: board, garment, rig, motion and how it is filmed. Read this header first.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/rig/rig.h"
#include "pattern/board/board.h"
#include "simulation/performance.h"
#include "simulation/printed_mesh.h"
#include "simulation/renderer.h"
#include "simulation/studio_rig.h"
#include "simulation/studio_scene.h"
#include "simulation/view_truth.h"

namespace weft {

// When each camera looks.
struct ShutterOptions {
  double exposure_ms = 0;     // of every picture; 0 freezes the motion
  double time_offset_ms = 0;  // middle of a camera's exposure against the frame's time; up to this, each way
  double drop_rate = 0;       // share of the pictures that are lost

  absl::Status Validate() const;
};

struct SyntheticTakeOptions {
  std::string name = "synthetic";  // part of the ids of board, rig and template
  uint64_t seed = 1;               // of the board and the shutters; the parts below have seeds of their own
  PerformanceOptions performance;
  std::string show;  // of several garments, the one that is filmed; empty: all
  StudioRigOptions rig;
  // Used instead of `rig`: the garment is placed where the cameras look.
  std::optional<Rig> given_rig;
  double crop_margin_mm = -1;  // 0 or more: pictures of a given rig are cropped to the garment and this much
  StudioOptions look;
  CameraOptions camera;
  ShutterOptions shutter;

  absl::Status Validate() const;
};

// A moment of the take, lit.
struct TakeFrame {
  int index = 0;
  int64_t time_ns = 0;  // 0 at the first frame
  StudioScene scene;    // exposed for a camera without time offset
};

struct FilmedView {
  int64_t mid_exposure_ns = 0;
  std::optional<Picture> picture;  // empty where it was lost
  ViewTruth truth;                 // in the middle of the exposure; empty where the picture was lost
};

// One picture to be.
struct Shot {
  int64_t mid_exposure_ns = 0;
  bool lost = false;
};

// Frames come in order; the pictures of a frame may be made by any number of threads. Deterministic.
class SyntheticTake {
 public:
  // Dresses the scene; `on_progress` (may be empty) is called with the share done, 0 to 1. Errors of the
  // options, GenerateBoard and Performance.
  static absl::StatusOr<SyntheticTake> Make(const SyntheticTakeOptions& options,
                                            const std::function<void(double)>& on_progress = {});
  // Goes on where SaveState was called in a take of the same options, as Performance::Resume does.
  static absl::StatusOr<SyntheticTake> Resume(const SyntheticTakeOptions& options, std::string_view state);

  const SyntheticTakeOptions& options() const { return options_; }
  const Board& board() const { return board_; }
  const Rig& rig() const { return rig_; }
  const Template& garment() const { return garment_; }
  int frames() const { return options_.performance.frames; }

  // The next frame; OutOfRange after the last. Casts its light in the calling thread's TBB arena. May run
  // beside Film.
  absl::StatusOr<TakeFrame> Next();
  // Passes over it: the cloth moves on, the light is spared.
  absl::Status Skip();
  // The next frame without light: cloth and body alone, where the rig sees them.
  absl::StatusOr<PerformanceFrame> NextCloth();
  // Unimplemented for cloth that nobody wears.
  absl::StatusOr<std::string> SaveState();
  int next() const { return next_; }
  Shot ShotOf(int frame, const std::string& camera_id) const;
  // What camera `camera` of the rig makes of it. The truth holds where cloth and camera were in the middle of
  // this camera's exposure, so the true mesh of the frame is that of a camera without time offset.
  absl::StatusOr<FilmedView> Film(const TakeFrame& frame, int camera) const;

 private:
  explicit SyntheticTake(Performance performance)
      : performance_(std::move(performance)), print_(performance_.garment().print), locator_(print_) {}
  absl::Status SetUp(const SyntheticTakeOptions& options);
  absl::Status ChooseShown();
  absl::Status PlaceGarment();
  absl::StatusOr<PerformanceFrame> NextMoment();

  SyntheticTakeOptions options_;
  Performance performance_;
  std::optional<PerformanceFrame> first_;  // until it is handed out
  std::vector<Face> shown_faces_;          // of the garment, or of the part that is filmed
  ClothPrint print_;                       // [shown faces]
  PrintLocator locator_;
  Eigen::AlignedBox3d first_box_mm_;                    // of the garment in the first frame
  Eigen::Vector3d place_mm_ = Eigen::Vector3d::Zero();  // of the garment in the rig's world
  int next_ = 0;
  Board board_;
  Rig rig_;
  Template garment_;
};

}  // namespace weft
