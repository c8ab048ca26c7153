// All that driving reads, loaded and checked against each other.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh_graph.h"
#include "alignment/mesh_texture.h"
#include "alignment/template.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "pattern/board/board_index.h"
#include "pattern/decoder.h"
#include "services/work/animation/avatar_file.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct DriveInputs {
  Rig rig;  // the cameras that are used
  BoardIndex board;
  Template garment;
  MeshGraph graph;
  MeshTexture texture;
  AvatarFile avatar;
  v1::InputHashes hashes;  // that of the rig covers all of its cameras
  DecodeOptions decode;
  std::vector<std::string> warnings;
};

// The frames of a take that are to be driven, in their order.
struct DriveFrameList {
  std::shared_ptr<const FrameSource> dump;
  std::vector<size_t> indices;   // in the dump
  std::vector<int64_t> time_ns;  // [indices]

  size_t size() const { return indices.size(); }
  const std::string& NameOf(size_t at) const { return dump->frame_names()[indices[at]]; }
  std::vector<std::string> Names() const;
};

// A registration's options with those that driving reads spelled out, and no others.
absl::StatusOr<v1::RegistrationOptions> EffectiveDriveOptions(const v1::RegistrationOptions& options);

// All but the take. InvalidArgument: an empty path, a camera that the rig does not have (those it has are
// named) or that is given twice, an option beyond its range. FailedPrecondition, both names in the message:
// template and board, or avatar and template, that do not belong together; hashes other than spec.expected.
// Errors of the files.
absl::StatusOr<std::unique_ptr<DriveInputs>> LoadDriveInputs(const v1::RegistrationSpec& spec,
                                                             NetReading reading = NetReading::kRun);

// Adds the warnings of the take to those of `inputs`. InvalidArgument: a range of frames without a frame.
// Errors of OpenDump.
absl::StatusOr<DriveFrameList> ListDriveFrames(const v1::RegistrationSpec& spec, DriveInputs& inputs);

// What a job's files tell of it.
v1::DrivenJob DescribeDriving(const v1::RegistrationSpec& spec, const DriveInputs& inputs);

// The cameras of these names, in the order of the rig; all for no names. InvalidArgument as above; `path`
// is the rig's.
absl::StatusOr<Rig> CamerasNamed(const Rig& rig, const std::vector<std::string>& names,
                                 const std::string& path);

}  // namespace weft
