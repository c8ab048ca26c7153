// When pictures are shown, where a container does not say it by itself.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/studio/video/video_packets.h"

namespace weft {

// AVI and GXF say when pictures are decoded, some MXF files too, and a decoder hands a picture out once it
// has those that follow from it: late, by as many pictures as it waits for. The times by the order in which
// pictures are shown: the k-th at the k-th of the packets' times. Empty where the file says when its pictures
// are shown.
struct DecodedTimes {
  std::vector<int64_t> pts;  // of pictures in the order in which they come, as ffmpeg gives them
  int waits = 0;             // the pictures for which the decoder waits
  bool is_damaged = false;   // ffmpeg complains of some
};
// InvalidArgument: pictures are damaged or missing, and nothing tells which.
absl::StatusOr<std::vector<int64_t>> TimesByOrder(const std::vector<VideoPacket>& packets,
                                                  const DecodedTimes& decoded);

// A part of the file's pictures that its edit list shows, in counts of the stream.
struct VideoEdit {
  int64_t media_time = 0;  // in what was filmed; -1: nothing is shown
  int64_t duration = 0;
};
// Of stream `stream`, from what ffprobe says of a file at level "debug".
std::vector<VideoEdit> ParseEdits(std::string_view log, int stream);

// InvalidArgument: the parts are not shown as they were filmed, one after another. Times behind such a cut
// are not those of the camera. `count_s`: of the stream. `packets` tell how far pictures are apart.
absl::Status CheckEdits(const std::vector<VideoEdit>& edits, const std::vector<VideoPacket>& packets,
                        double count_s);

}  // namespace weft
