// What a video file holds: size, pixels, the time of every frame that can be decoded.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "services/video/timecode.h"
#include "weft/v1/video.pb.h"

namespace weft {

// Is the name that of a video: .mp4, .mov, .mkv, .m4v, .avi, .mxf, .webm, .ts?
bool IsVideoName(const std::string& path);

// `frames`: decoded so far; false stops.
using FramesSeen = std::function<bool(uint64_t frames)>;

// Decodes the first video stream of the file once. Frames that are damaged beyond decoding are not among
// frame_pts; `complaint` tells of them. `path` is absolute and without links. NotFound. InvalidArgument: no
// video, one without times, pictures that change size; names the file and a remedy. DeadlineExceeded,
// Cancelled, and errors of VideoProgram::Start.
absl::StatusOr<v1::VideoFacts> LookAtVideo(const std::string& path, const FramesSeen& seen = nullptr);

// What a file with sound says of it, and of nothing else. Errors as LookAtVideo.
absl::StatusOr<v1::VideoFacts> ReadSoundHeader(const std::string& path);

// Arguments before "-i" that all decoding shares: so that every run decodes the same frames.
std::vector<std::string> DecodingArguments();
// The filter that writes a line for each frame; ParseFrameLines reads it. `where`: "pipe:1".
std::string FrameLinesFilter(const std::string& where);

// What ffprobe prints as "flat", and what the filter `metadata` prints; no file is read.
absl::StatusOr<v1::VideoFacts> ParseVideoHeader(std::string_view flat);
absl::StatusOr<v1::VideoFacts> ParseSoundHeader(std::string_view flat);
absl::StatusOr<std::vector<int64_t>> ParseFrameLines(std::string_view lines);

// Seconds by the file's own count.
std::vector<double> FrameTimes_s(const v1::VideoFacts& facts);
// The middle one of the distances between frames; 0 with fewer than two.
double Period_s(const v1::VideoFacts& facts);
double Period_s(const std::vector<double>& times_s);
// Of the first frame. NotFound: the file has none. InvalidArgument as ParseTimecode.
absl::StatusOr<Timecode> TimecodeOfFirst(const v1::VideoFacts& facts);

}  // namespace weft
