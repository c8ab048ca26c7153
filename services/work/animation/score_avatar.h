// How well an avatar follows its garment, against the truth.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "capture/take/frame_range.h"
#include "weft/v1/avatar.pb.h"

namespace weft {

struct AvatarScoring {
  std::string avatar;
  // An avatar of the preset paper, driven beside it by the same observations; empty: none.
  std::string baseline;
  // Data sets, and takes of `weft simulate` with or without pictures. Pictures are decoded; without them the
  // decoder is imitated (truth_views.h), or pictures are rendered and decoded (filmed_views.h).
  std::vector<std::string> sources;
  std::string garment;  // folder of the template; empty: the sources'
  std::vector<std::string> splits = {"test-known", "test-unseen"};  // of data sets
  std::vector<int> cameras = {2, 3};                                // numbers of them, each scored by itself
  FrameRange frames = {0, SIZE_MAX};                                // of each take, by position
  double fps = 0;                                                   // of takes that tell no times; 0: 30
  int threads = 1;    // that drive; what cameras see is made by all
  uint64_t seed = 1;  // of what cameras see
  bool films = false;
  // Takes without pictures are also driven before two cameras in other places, each frame by itself, and
  // while the first of two is dark for 15 frames.
  bool with_trials = false;
  // Folder for <take>-<cameras>/<frame>/mesh.ply, with sigma, and truth.ply beside it; empty: none.
  std::string meshes;

  absl::Status Validate() const;
};

// Drives every take before every number of cameras. Beside the driven mesh are scored, in the same run, the
// carrier, the mesh "without net" where the avatar has one, the shape that the avatar has nearest to the
// truth, and its mean shape, both at their true place. With 8 cameras and more it is compared with what `weft
// register` makes of the same observations, and where the wearer's pose is known with cloth that skinning
// moves (baseline_meshes.h). A baseline is driven where there are two cameras: "paper", its carrier "paper
// carrier", and with trials "paper elsewhere". Where pictures are rendered, it is also driven by imitated
// observations of the same frames ("imitated"). Takes of a hand before the garment have a row of their own
// ("hand before"). Frames that are lost have no errors and are counted. Numbers of cameras that a take with
// pictures does not have are left out with a remark. Trials have methods of their own (driving_trials.h).
// `on_frame` (may be empty) is called with frames driven and all. Errors of the files; FailedPrecondition,
// both names in it, for an avatar of another template; InvalidArgument for a take without any of `frames`;
// NotFound where no take is of `splits`; Cancelled when `stop` is requested. The same figures at any number
// of threads, times aside.
absl::StatusOr<v1::AvatarEvaluation> ScoreAvatar(const AvatarScoring& scoring,
                                                 const std::function<void(size_t done, size_t all)>& on_frame,
                                                 const std::stop_token& stop);

}  // namespace weft
