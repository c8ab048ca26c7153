// What a garment was learnt to do, so that a few cameras suffice to follow it (docs: animation/README.md).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/atlas/atlas.h"
#include "animation/avatar/sigma_scale.h"
#include "animation/rays/isometric_fit.h"
#include "animation/shape/shape_space.h"
#include "nets/net.h"

namespace weft {

struct SparseViewTraining {
  int components = 48;    // of the shape space
  int max_frames = 4000;  // to learn from, at most; of more, evenly spaced ones
  // For each number of cameras: held-out frames, and as many of motions that are left out in turn.
  int calibration_frames = 40;
  uint64_t seed = 1;

  absl::Status Validate() const;
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

}  // namespace weft
