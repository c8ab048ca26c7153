// All that driving reads, loaded and checked against each other.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh_graph.h"
#include "alignment/mesh_texture.h"
#include "alignment/template.h"
#include "animation/sparse_view_driver.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "pattern/board/board_index.h"
#include "pattern/decoder.h"
#include "services/animation/avatar_file.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct DriveRequest {
  // dump, rig, board, garment, out, frames and options.mosaic as of a registration. options.pipeline has
  // every option of the stage decode.
  v1::RegistrationSpec spec;
  std::string avatar;
  std::vector<std::string> cameras;  // of the rig; empty: all
  double fps = 0;                    // of a take that tells no times; 0: the avatar's
  bool write_observations = false;
  DecodeOptions decode;
  int threads = 0;  // 0: all cores
};

struct DriveInputs {
  Rig rig;  // the cameras that are used
  BoardIndex board;
  Template garment;
  MeshGraph graph;
  MeshTexture texture;
  AvatarFile avatar;
  std::unique_ptr<FrameSource> dump;
  v1::InputHashes hashes;  // that of the rig covers all of its cameras
  std::vector<std::string> warnings;
  std::vector<size_t> frames;    // positions in the dump
  std::vector<int64_t> time_ns;  // [frames]
};

// InvalidArgument: an empty path, a camera that the rig does not have (those it has are named) or that is
// given twice, a range of frames without a frame. FailedPrecondition, both names in the message: template and
// board, or avatar and template, that do not belong together. Errors of the files.
absl::StatusOr<std::unique_ptr<DriveInputs>> LoadDriveInputs(const DriveRequest& request);

// The cameras of these names, in the order of the rig; all for no names. InvalidArgument as above; `path`
// is the rig's.
absl::StatusOr<Rig> CamerasNamed(const Rig& rig, const std::vector<std::string>& names,
                                 const std::string& path);

}  // namespace weft
