// Videos of several cameras become a take, put in step.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/take/stream_writer.h"
#include "services/studio/video/camera_offsets.h"
#include "weft/v1/take.pb.h"

namespace weft {

struct VideoFile {
  std::string camera;
  std::string path;
};

struct VideoImportOptions {
  std::vector<VideoFile> videos;
  // Files; empty: none. The rig says which cameras there are and how large their pictures; with both, offsets
  // follow from motion.
  std::string rig, board;
  SyncWay sync = SyncWay::kAuto;
  double max_offset_s = 0.75;              // between cameras, beyond what timecode says
  std::map<std::string, double> given_s;   // offsets that are known, by camera
  std::map<std::string, std::string> ltc;  // sound files that begin with the video, by camera
  std::optional<PixelFormat> mosaic;       // of grey videos
  StreamWriterOptions stream{.preallocate_bytes = uint64_t{32} << 20};
  v1::Take said;  // its slate, name and notes
};

struct VideoImportResult {
  v1::Take take;
  std::vector<std::string> warnings;  // what a user should know: variable rates, damage, lengths
};

// `stage`: "look", "sync" or "import". False stops the import (Cancelled); it may go on later.
using VideoImportProgress = std::function<bool(const char* stage, uint64_t done, uint64_t total)>;

// Every frame that is whole is in the take, with its time by the axis of all; those of cameras that
// film faster than the slowest one excepted, which are counted. All is written beside `out`, in
// <out>.unfinished, and a call with the same arguments goes on from what stands there. AlreadyExists: `out`
// holds something. InvalidArgument, NotFound, FailedPrecondition: a video, the rig or what they say of each
// other; the message names file and remedy. ResourceExhausted: the disk. DataLoss: VideoFrames.
absl::StatusOr<VideoImportResult> ImportVideos(const VideoImportOptions& options, const std::string& out,
                                               const VideoImportProgress& progress = nullptr);

}  // namespace weft
