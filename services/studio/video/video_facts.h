// What a video file holds: size, pixels, the time of every frame that can be decoded and used.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/video.pb.h"

namespace weft {

// `frames`: decoded so far; false stops.
using FramesSeen = std::function<bool(uint64_t frames)>;

// Decodes the first video stream of the file, and looks closely at it where something is wrong. Frames that
// are damaged, or follow from damaged ones, are not among frame_pts; `complaint` tells of them. `path` is
// absolute and without links. NotFound. InvalidArgument: no video, one without times or whole pictures,
// pictures that change size; names the file and a remedy. DeadlineExceeded, Cancelled, and errors of
// VideoProgram::Start.
absl::StatusOr<v1::VideoFacts> InspectVideo(const std::string& path, const FramesSeen& seen = nullptr);

// What a file with sound says of it, and of nothing else. Errors as InspectVideo.
absl::StatusOr<v1::VideoFacts> ReadSoundHeader(const std::string& path);

// Arguments before "-i" that all decoding shares: so that every run decodes the same frames.
std::vector<std::string> DecodingArguments(const v1::VideoFacts& facts);
// The filter that writes a line for each frame; ParseFrameLines reads it. `where`: "pipe:1".
std::string FrameLinesFilter(const std::string& where);

// What ffprobe prints as "flat", and what the filters print; no file is read.
absl::StatusOr<v1::VideoFacts> ParseVideoHeader(std::string_view flat);
absl::StatusOr<v1::VideoFacts> ParseSoundHeader(std::string_view flat);
struct FrameLines {
  std::vector<int64_t> pts;  // in the order in which they come
  uint64_t interlaced = 0;   // frames that are coded as two fields
};
absl::StatusOr<FrameLines> ParseFrameLines(std::string_view lines);

// Which of the frames that come are used: those that are not damaged (`damaged_pts`, sorted) and are later
// than all before them. Sets frame_pts, unused and same_time. InvalidArgument: times go back in sound ones.
absl::Status UseFrames(const std::vector<int64_t>& pts, const std::vector<int64_t>& damaged_pts,
                       v1::VideoFacts& facts);

}  // namespace weft
