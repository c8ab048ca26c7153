// Images of a job's cameras with its meshes over them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "services/results/report/frame_pictures.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

// The take and the rig that a job was computed from.
class JobImages {
 public:
  // NotFound: take or rig are not there any more. FailedPrecondition: the rig is not that of the job. Errors
  // of OpenDump.
  static absl::StatusOr<JobImages> Open(const v1::Job& job);

  // The mesh in the image of the camera that read most cells of the frame, and of the one that read most
  // among those that look from another side; fewer where images cannot be read. `report` is that of the
  // frame.
  std::vector<MeshPicture> Overlays(const v1::FrameReport& report, const PicturedMesh& mesh) const;
  // The whole images of the same cameras, of the first two where none read a cell. JPEG.
  std::vector<MeshPicture> Plain(const v1::FrameReport& report) const;

 private:
  Rig rig_;
  std::unique_ptr<FrameSource> dump_;
};

// The cameras of the overlays, positions in the rig; at most two.
std::vector<size_t> CamerasToShow(const Rig& rig, const v1::FrameReport& report);

}  // namespace weft
