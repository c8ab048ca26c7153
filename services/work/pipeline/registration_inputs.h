// Everything that a registration reads, loaded and checked against each other once per process.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "alignment/cell_prediction.h"
#include "alignment/mesh_texture.h"
#include "alignment/template.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "pattern/board/board_index.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Immutable once loaded. Thread safety: const access from any number of threads.
struct RegistrationInputs {
  Rig rig;
  BoardIndex board;
  Template garment;
  std::unique_ptr<AlignmentModel> model;  // of `garment`
  std::unique_ptr<FrameSource> dump;
  v1::InputHashes hashes;
  std::vector<CellNeighborhood> neighborhoods;  // of `garment`
  std::vector<std::string> warnings;            // cameras without images, images of unknown cameras
  std::vector<double> camera_sigma_px;          // ReadCameraSigmas of the rig
  MeshTexture texture;                          // of `garment`, for its meshes
};

// Reads rig, board, template and the list of the dump's images. Errors keep the category of the file that
// causes them. InvalidArgument: an empty field of `spec` (named), an unknown preset, an option beyond its
// range, a board with double codes. FailedPrecondition: a template of another board, or hashes other than
// spec.expected; both hashes are named.
absl::StatusOr<std::unique_ptr<RegistrationInputs>> LoadInputs(const v1::RegistrationSpec& spec);

// FailedPrecondition, with both hashes: others than spec.expected.
absl::Status CheckExpectedHashes(const v1::RegistrationSpec& spec, const v1::InputHashes& hashes);

// Positions in the dump of the frames that `spec` asks for, by name (FindFrameRange) or by position.
// InvalidArgument: an empty range, one that ends outside the dump, or both ways at once; names what the dump
// holds.
absl::StatusOr<std::vector<size_t>> FramesInRange(const v1::RegistrationSpec& spec,
                                                  const std::vector<std::string>& frame_names);

// Adds what CheckExtras says of scans and starts of these frames, by their positions, to inputs.warnings.
// Errors of CheckExtras.
absl::Status AddExtraWarnings(const v1::RegistrationSpec& spec, const std::vector<size_t>& frames,
                              RegistrationInputs& inputs);

}  // namespace weft
