// The preset paper beside an avatar that is scored: driven by the same observations of the same frames.
#pragma once

#include <tbb/task_arena.h>

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/paper/pixel_driver.h"
#include "capture/rig/rig.h"
#include "evaluation/driving_score.h"
#include "services/formats/synthetic/frames_file.h"
#include "services/work/animation/score_table.h"
#include "triangulation/triangulate.h"

namespace weft {

// Nothing where no path is given. Errors of ReadPixelAvatar and CheckAvatarFits.
absl::StatusOr<std::optional<PixelAvatar>> ReadBaseline(const std::string& path, const Template& garment,
                                                        const std::string& garment_path);

class PaperBaseline {
 public:
  // Both must outlive it; `avatar` may be null, and nothing is scored then.
  PaperBaseline(const Template& garment, const PixelAvatar* avatar) : garment_(garment), avatar_(avatar) {}

  // A take begins. It is not driven before other numbers of cameras than kPixelCameras. Errors of
  // PixelDriver::Create.
  absl::Status Begin(int cameras);

  struct Frame {
    const ClothFrame& truth;
    const std::vector<ViewObservations>& seen;
    const Rig& rig;
    const VertexRays& directions;  // from which vertices were seen
    bool follows;                  // it is not the first
  };
  // Adds "paper" and `suffix` to the scores, and "paper carrier" where there is none. Errors of the driver
  // and of DrivingScore.
  absl::Status Add(const Frame& frame, const std::string& split, const char* suffix, tbb::task_arena& driving,
                   ScoreTable& scores);

 private:
  const Template& garment_;
  const PixelAvatar* avatar_;
  std::optional<PixelDriver> driver_;
};

}  // namespace weft
