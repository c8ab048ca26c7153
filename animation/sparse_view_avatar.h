// What a garment was learnt to do, so that a few cameras suffice to follow it (docs: animation/README.md).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/atlas.h"
#include "animation/isometric_fit.h"
#include "animation/shape_space.h"
#include "nets/net.h"

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

struct SparseViewTraining {
  int components = 48;    // of the shape space
  int max_frames = 4000;  // to learn from, at most; of more, evenly spaced ones
  // For each number of cameras: held-out frames, and as many of motions that are left out in turn.
  int calibration_frames = 40;
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// What the sigma of a driven vertex is made of: factors by the number of cameras with rays (1, 2, 3, 4 and
// more) and by the vertex's own rays. With 1, 2, 3 and more they multiply RayDrivenFrame::scale_mm. A vertex
// without a ray is off as one with one ray, and in quadrature by the factor for 0 times growth_mm.
struct SigmaScale {
  static constexpr int kCameras = 4, kRays = 4;
  std::array<std::array<float, kRays>, kCameras> of{};

  // Sigma by such a row of factors.
  static float Sigma(const std::array<float, kRays>& of_rays, int rays, float scale_mm, float growth_mm);
};

// Frames that sigma was fitted to, and which share of their vertices' errors is within one and two sigma.
struct SigmaCheck {
  int frames = 0;
  double within_one = 0, within_two = 0;
  // How unlikely the errors are by their sigmas, mean of log(sigma) + ratio^2 / 2 with ratios up to 6: by
  // which the numbers of ray_driver.cpp were chosen. Not kept in files.
  double loss = 0;
};

// Mean errors of driven meshes, in mm: of the same frames without the net and with it.
struct NetGain {
  int frames = 0;
  double before_mm = 0, after_mm = 0;
};

// A net that says how far driven meshes are off; driving_features.h has what it is told and answers.
struct AvatarNet {
  // It learns from two cameras and more, and is not asked about one.
  static constexpr int kLeastCameras = 2;

  std::string onnx;  // bytes of the file; empty: the avatar has no net
  AtlasOptions atlas;
  // An image with the answer that the trainer got, to be compared where the net is loaded.
  Tensor sample, sample_answer;
  // On held-out frames before 1, 2, 3, and 4 cameras.
  std::array<NetGain, SigmaScale::kCameras> gain{};

  bool empty() const { return onnx.empty(); }
  // Whether its held-out frames are, over all cameras, nearer to the truth with it.
  bool IsOfUse() const;
};

struct SparseViewAvatar {
  std::string template_hash;  // Template::ContentHash
  std::string board_hash;
  double fps = 30;  // of the takes that were learnt from
  int training_frames = 0, held_out_frames = 0;
  SparseViewTraining training;
  ShapeSpace space;
  std::vector<float> acceleration;    // [components], spread of z_t - 2 z_(t-1) + z_(t-2)
  std::vector<float> edge_mm;         // [edges of MeshGraph], mean length over the training frames
  std::vector<float> edge_follow;     // [edges], 0 to 1: share of a carrier's difference from that to believe
  std::vector<float> edge_spread_mm;  // [edges], standard deviation of what is left
  std::vector<float> left_mm;         // [vertices], root mean square per axis of what the space leaves
  SigmaScale sigma;                   // the typical one where the checks have no frames
  // Of frames that are held out, and of learnt frames of which an avatar without their motion was made.
  SigmaCheck held_out_check, left_out_check;
  AvatarNet net;

  EdgeLengths edges() const { return {edge_mm, edge_follow, edge_spread_mm}; }

  // InvalidArgument names what is wrong: sizes that do not fit each other, numbers that are not finite or not
  // positive where they must be.
  absl::Status Validate() const;
  // FailedPrecondition, with both names, for a template or board that the avatar was not made for.
  absl::Status CheckFits(const Template& garment) const;
};

// FailedPrecondition, with both hashes, for a template or board other than those that an avatar was learnt
// with.
absl::Status CheckLearntWith(const std::string& template_hash, const std::string& board_hash,
                             const Template& garment);

// The numbers of an avatar as tables, for files: new versions may add tables, and `name` says which is which.
struct AvatarTable {
  std::string name;
  int rows = 0, columns = 0;
  // Bases are kept in 16 bits: to 1/32767 of the largest value of a row.
  bool sixteen_bits = false;
  std::vector<float> values;  // [rows][columns]
};
// All numbers of the avatar that are not hashes, fps, counts, checks or training options.
std::vector<AvatarTable> TablesOf(const SparseViewAvatar& avatar);
// Fills these numbers; InvalidArgument names a table that is missing, or has another size than the others
// imply. Avatars made before there was edge_follow have 0 in its place, those made before sigma_factors the
// typical ones. Unknown tables are passed over.
// Validate() says whether the whole makes sense.
absl::Status TakeTables(const std::vector<AvatarTable>& tables, SparseViewAvatar* avatar);

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
