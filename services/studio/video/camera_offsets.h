// By how much the times of videos differ, from what the files say.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/video.pb.h"

namespace weft {

// How offsets are found: kAuto takes timecode where all videos have it, and motion where they do not.
enum class SyncWay { kAuto, kTimecode, kLtc, kMotion, kFileTimes, kTogether };
// "auto", "timecode", "ltc", "motion", "file-times", "together"; InvalidArgument lists them.
absl::StatusOr<SyncWay> SyncWayFromName(const std::string& name);
std::string NameOf(SyncWay way);

// In the order of the videos. FailedPrecondition: a video does not say what is asked for; it is named, with
// the remedy. Timecode counts frames, so its offsets are sure to a part of one; times of files to a second.
absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByTimecode(const std::vector<v1::VideoFacts>& videos);
absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByFileTimes(const std::vector<v1::VideoFacts>& videos);
// All of them begin at one moment.
std::vector<v1::CameraSync> OffsetsTogether(const std::vector<v1::VideoFacts>& videos);

// Replaces those that somebody gave. InvalidArgument: a camera without a video.
absl::Status UseGivenOffsets(const std::map<std::string, double>& given_s,
                             const std::vector<v1::VideoFacts>& videos, std::vector<v1::CameraSync>& syncs);

// Adds one number to all offsets: the first frame of all is then at time 0.
void BeginAtZero(const std::vector<v1::VideoFacts>& videos, std::vector<v1::CameraSync>& syncs);

// The frames' times of each video on the axis of all.
std::vector<std::vector<double>> CommonFrameTimes_s(const std::vector<v1::VideoFacts>& videos,
                                                    const std::vector<v1::CameraSync>& syncs);

// What is known of a video's own times: timecode, rate, how much it varies.
void DescribeTimes(const v1::VideoFacts& facts, v1::CameraSync& sync);
// Whether the distances of frames differ by more than rounding to milliseconds makes them.
bool HasVariableRate(const v1::VideoFacts& facts);

}  // namespace weft
