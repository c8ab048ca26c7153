// `weft export --overlay`: the pictures of cameras with the registered mesh over them.
#pragma once

#include <stop_token>

#include "absl/status/statusor.h"
#include "services/results/export/export_request.h"
#include "services/results/export/export_result.h"
#include "services/results/export/overlay_drawing.h"

namespace weft {

// Pictures, or a video of each camera (H.264).
enum class PictureFormat { kJpeg, kPng, kMp4, kMkv };
// "jpg", "png", "mp4", "mkv": ending and name of --format.
const char* EndingOf(PictureFormat format);
bool IsVideo(PictureFormat format);

struct OverlayRequest : ExportScope {
  OverlayKind kind = OverlayKind::kWireframe;
  bool undistort = false;  // as WithoutDistortion (undistorted_picture.h) sees it
  PictureFormat format = PictureFormat::kJpeg;
};

// Writes <out>/<camera>/<frame>.jpg or .png, of videos <out>/<camera>.mp4 or .mkv, of undistorted ones
// <out>/rig.json with the cameras that they are of, and export.json last; it stops and goes on as
// ExportResult does, with videos one by one. Pictures that the dump lacks are left out, with a line in the
// warnings. Errors of ExportResult, ReadRig and OpenDump; FailedPrecondition: the rig is not that of the job.
// InvalidArgument: a camera that the rig lacks, a video without a frame rate. NotFound, Internal: the program
// ffmpeg, which makes videos.
absl::StatusOr<ExportOutcome> ExportOverlays(const OverlayRequest& request, const ExportProgress& progress,
                                             const std::stop_token& stop);

}  // namespace weft
