// `weft export --overlay`: the pictures of cameras with the registered mesh over them.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/export/export_request.h"
#include "services/export/export_result.h"
#include "services/export/overlay_drawing.h"

namespace weft {

enum class PictureFormat { kJpeg, kPng };

struct OverlayRequest {
  std::string result, out;
  std::string frames;                // as in ExportRequest
  std::string dump, rig;             // empty: those of the job
  std::vector<std::string> cameras;  // ids; empty: all of the rig
  OverlayKind kind = OverlayKind::kWireframe;
  int texture_px = 0;  // not 0: instead of overlays, a texture of this size from all these cameras
  PictureFormat format = PictureFormat::kJpeg;
  bool allow_unfinished = false;
};

// Writes <out>/<camera>/<frame>.jpg or .png, of textures <out>/<frame>.png, and export.json last; it stops
// and goes on as ExportResult does. Pictures that the dump lacks are left out, with a line in `warnings`.
// Errors of ExportResult, ReadRig and OpenDump; FailedPrecondition: the rig is not that of the job.
// InvalidArgument: a camera that the rig lacks.
absl::StatusOr<ExportOutcome> ExportOverlays(const OverlayRequest& request, const ExportProgress& progress,
                                             const std::stop_token& stop, std::vector<std::string>& warnings);

}  // namespace weft
