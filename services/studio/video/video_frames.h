// The pictures of a video, one after the other.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "services/studio/video/video_program.h"
#include "weft/v1/video.pb.h"

namespace weft {

// A range of frames, by their position in VideoFacts.frame_pts.
struct VideoRange {
  size_t first = 0, count = 0;
};

// Grey videos give grey pictures, or a mosaic of the order `mosaic`; all others RGB in 8 bits.
PixelFormat VideoPixelFormat(const v1::VideoFacts& facts, std::optional<PixelFormat> mosaic);

class VideoFrames {
 public:
  // InvalidArgument: a mosaic for a video in colours. Errors of VideoProgram::Start.
  static absl::StatusOr<VideoFrames> Start(const v1::VideoFacts& facts, const VideoRange& range,
                                           std::optional<PixelFormat> mosaic);

  // The next one. DataLoss: the file does not give the frame that it gave before.
  absl::StatusOr<Frame> Next();
  // After the last one: that all of them were those that were looked at, by their times. DataLoss.
  absl::Status Finish();

 private:
  // Places among all pictures that the file gives; those that are not used are read and left.
  struct Places {
    uint64_t first = 0, count = 0;
    std::vector<bool> used;
  };
  static Places PlacesOf(const v1::VideoFacts& facts, const VideoRange& range);
  VideoFrames(const v1::VideoFacts& facts, Places places, VideoProgram ffmpeg, PixelFormat format)
      : facts_(facts), places_(std::move(places)), ffmpeg_(std::move(ffmpeg)), format_(format) {}
  absl::Status Changed(const std::string& why) const;

  const v1::VideoFacts& facts_;
  const Places places_;
  uint64_t next_ = 0;  // of places_
  VideoProgram ffmpeg_;
  const PixelFormat format_;
};

}  // namespace weft
