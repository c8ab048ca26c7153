// When the frames of a video are shown.
#pragma once

#include <vector>

#include "weft/v1/video.pb.h"

namespace weft {

// Seconds by the file's own count. Where the frames of an even film are rounded to counts (Matroska: to
// milliseconds), the times are those of the even film: by its rate, or by a line through all of them.
std::vector<double> FrameTimes_s(const v1::VideoFacts& facts);

// When the film begins, as FrameTimes_s counts: its first picture, which may be one that cannot be decoded.
double BeginTime_s(const v1::VideoFacts& facts);

// The middle one of the distances between frames; 0 with fewer than two.
double Period_s(const v1::VideoFacts& facts);
double Period_s(const std::vector<double>& times_s);

}  // namespace weft
