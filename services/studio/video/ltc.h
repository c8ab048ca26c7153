// Linear timecode: SMPTE 12M timecode as sound, by libltc.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/studio/video/timecode.h"
#include "weft/v1/video.pb.h"

namespace weft {

struct LtcReading {
  Timecode timecode;   // of the first frame that was read, with the rate that was measured
  double first_s = 0;  // when that frame begins in the sound
  double sigma_s = 0;  // of it, from the scatter of all
  int frames = 0;
};

// One channel. NotFound: no timecode, or less than half a second of it in order.
absl::StatusOr<LtcReading> ReadLtc(const std::vector<int16_t>& samples, double rate_hz);

// Offsets from the sound of each video or, for cameras in `files`, from a sound file that begins with the
// video. Sets timecode and its rate in `videos`, unless it fails. The first two minutes of every channel are
// searched. FailedPrecondition: a camera without linear timecode; names the file and the remedy. Errors of
// VideoProgram.
absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByLtc(const std::map<std::string, std::string>& files,
                                                         std::vector<v1::VideoFacts>& videos);

}  // namespace weft
