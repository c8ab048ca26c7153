// Learning what a garment does from complete meshes of it.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/avatar/sparse_view_avatar.h"

namespace weft {

// Complete meshes of the garment while it is worn: takes of frames that follow each other.
struct TrainingTake {
  std::string name;
  int frames = 0;
  double fps = 30;
  // Not learnt from: these say how far the avatar is to be trusted.
  bool held_out = false;
  std::string motion;  // takes of one kind of motion have the same; empty: a kind of its own
};
struct TrainingFrames {
  std::vector<TrainingTake> takes;
  // Vertices of a frame in mm, [vertices]. Called from the calling thread, in any order, several times a
  // frame.
  std::function<absl::StatusOr<std::vector<Eigen::Vector3d>>(int take, int frame)> read;
};

// May be empty. Called with what is being done ("shapes", "lengths", "sigma") and the share of it done.
using TrainingProgress = std::function<void(std::string_view stage, double share)>;

// Where the last frame stands that is learnt from, and no further: without held-out takes the last tenth of
// each take is held out.
int LearntFrames(const std::vector<TrainingTake>& takes, size_t take);

// Learns shapes, lengths and motion; sigma's factors stay 1, and there is no net.
// InvalidArgument names what is wrong with the input: fewer than ten frames to learn from, a frame with
// another number of vertices than the template; errors of `read`; Cancelled when `stop` is requested.
// The same bytes at any thread count.
absl::StatusOr<SparseViewAvatar> LearnSparseView(const Template& garment, const TrainingFrames& frames,
                                                 const SparseViewTraining& training,
                                                 const TrainingProgress& on_progress = {},
                                                 const std::stop_token& stop = {});

// Fits sigma to held-out frames and, where there are two motions and more, to motions that were not learnt:
// each is left out in turn and driven by what few frames of the others teach. Where the avatar has a net,
// held-out frames are driven with it, and its gain is measured; it has learnt from the motions that are left
// out, so those are driven without. A net that brings held-out frames no nearer to the truth is taken off:
// its gain alone stays. `frames` and errors as of LearnSparseView, those of NetCorrection::Create besides.
absl::Status CalibrateSparseView(const Template& garment, const TrainingFrames& frames,
                                 const TrainingProgress& on_progress, const std::stop_token& stop,
                                 SparseViewAvatar* avatar);

// Learns and calibrates an avatar without a net.
absl::StatusOr<SparseViewAvatar> TrainSparseView(const Template& garment, const TrainingFrames& frames,
                                                 const SparseViewTraining& training,
                                                 const TrainingProgress& on_progress = {},
                                                 const std::stop_token& stop = {});

}  // namespace weft
