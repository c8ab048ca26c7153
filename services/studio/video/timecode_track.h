// Timecode of a video: its label, the rate at which that counts, and the frame that it belongs to.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/studio/video/flat_values.h"
#include "services/studio/video/timecode.h"
#include "weft/v1/video.pb.h"

namespace weft {

// Number of the stream of QuickTime timecode ("tmcd") that the first video names or, where it names none, of
// the first one; -1 without any. `header`: of ffprobe, all streams.
int TimecodeTrackOf(const FlatValues& header);

// Label, rate and moment of a timecode track, as ffprobe prints it with its data. A track counts frames at a
// rate of its own, which is not that of the film: 29.97 in one of 59.94. NotFound: it holds none.
// InvalidArgument: its numbers make no sense. Sets timecode, timecode_fps, is_timecode_fps_sure and
// timecode_at_s of `facts`.
absl::Status ParseTimecodeTrack(std::string_view flat, v1::VideoFacts& facts);
// By ffprobe, which reads stream `index` of the file. Errors of VideoProgram and ParseTimecodeTrack.
absl::Status ReadTimecodeTrack(int index, v1::VideoFacts& facts);

// The rate at which the timecode of each video counts. Where a file is not exact (phones write the mean rate
// of their frames), it is that of the other videos, since 29.97 and 30 part by 3.6 s in an hour. A rate of 0:
// the film has no rate at which timecode counts.
std::vector<double> TimecodeRates(const std::vector<v1::VideoFacts>& videos);

// The label and when its frame is shown by the file's count.
struct TimecodeAt {
  Timecode timecode;
  double at_s = 0;
};
// NotFound: the file has none. InvalidArgument as ParseTimecode.
absl::StatusOr<TimecodeAt> LabelOf(const v1::VideoFacts& facts, double fps);
// Of the first frame that is used. Errors as LabelOf.
absl::StatusOr<Timecode> TimecodeOfFirst(const v1::VideoFacts& facts);

}  // namespace weft
