// What overlays, textures and videos of a result share: its recording, its rig, the cameras.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "services/results/export/export_folder.h"
#include "services/results/export/export_overlays.h"
#include "services/results/export/export_source.h"
#include "services/results/export/overlay_drawing.h"
#include "services/results/report/mesh_colors.h"

namespace weft {

// All that stays from picture to picture.
struct OverlayPlan {
  Rig rig;
  std::unique_ptr<FrameSource> dump;
  std::map<std::string, size_t> index_of_frame;  // in the dump
  std::vector<size_t> cameras;                   // in the rig
  ScalarRange sigma_range_mm;                    // of the first mesh
};

// Meshes in the rig's world and mm.
ExportRequest InTheWorld(const ExportScope& scope);

// `source` is surveyed, in the rig's world and mm. FailedPrecondition: the rig is not that of the job.
// InvalidArgument: a camera that the rig lacks. NotFound: a frame that the recording lacks. Errors of ReadRig
// and OpenDump.
absl::StatusOr<OverlayPlan> PlanOverlays(const RecordingChoice& recording, ExportSource& source);

// The mesh of a frame as it is drawn; `mesh_number` counts in source.meshes().
absl::StatusOr<OverlayMesh> ReadOverlayMesh(OverlayKind kind, const OverlayPlan& plan, ExportSource& source,
                                            size_t mesh_number);

// <camera>.mp4 or .mkv of each camera, each with its name when it is complete; those that are there are kept.
// Frames without a mesh show the picture alone, those without a picture the one before. Errors of
// ExportOverlays; NotFound, Internal: the program ffmpeg. Cancelled: a stop was requested; a video that was
// begun is begun anew.
absl::Status WriteOverlayVideos(const OverlayRequest& request, const OverlayPlan& plan, ExportSource& source,
                                const ExportFolder& folder, const ExportProgress& progress,
                                const std::stop_token& stop, std::vector<std::string>& warnings);

}  // namespace weft
