// Frames whose every byte follows from camera and set, so that what comes back can be checked without the
// original.
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "capture/image/raw_frame.h"

namespace weft {

// A table of noise that starts at another place for each camera and set: as quick as a copy.
class PatternFrames {
 public:
  PatternFrames(std::vector<std::string> camera_ids, int width_px, int height_px,
                RawFormat format = RawFormat::kBayerRg8)
      : camera_ids_(std::move(camera_ids)),
        width_px_(width_px),
        height_px_(height_px),
        format_(format),
        bytes_(RawBytes(format, width_px, height_px)),
        pool_(bytes_, 64),
        noise_(bytes_ + kStarts) {
    uint64_t state = 1;
    for (uint8_t& b : noise_) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      b = static_cast<uint8_t>(state >> 56);
    }
  }

  const std::vector<std::string>& camera_ids() const { return camera_ids_; }

  RawFrame Frame(size_t camera, uint64_t set) {
    auto bytes = pool_.Take();
    std::memcpy(bytes->data(), Expected(camera, set), bytes_);
    RawFrame frame;
    frame.camera_id = camera_ids_[camera];
    frame.width_px = width_px_;
    frame.height_px = height_px_;
    frame.format = format_;
    frame.bytes = std::move(bytes);
    frame.device_time_ns = Time_ns(set) + static_cast<int64_t>(camera);
    frame.host_time_ns = frame.device_time_ns + 5;
    frame.device_frame_id = set + 7;
    return frame;
  }

  RawFrameSet Set(uint64_t number) {
    RawFrameSet set;
    set.number = number;
    set.device_time_ns = Time_ns(number);
    for (size_t camera = 0; camera < camera_ids_.size(); ++camera)
      set.frames.push_back(Frame(camera, number));
    return set;
  }

  // True where the frame is what Frame made, in every byte and number.
  bool IsExact(const RawFrame& frame, size_t camera, uint64_t set) const {
    return frame.camera_id == camera_ids_[camera] && frame.width_px == width_px_ &&
           frame.height_px == height_px_ && frame.format == format_ &&
           frame.device_time_ns == Time_ns(set) + static_cast<int64_t>(camera) &&
           frame.host_time_ns == frame.device_time_ns + 5 && frame.device_frame_id == set + 7 &&
           frame.bytes->size() == bytes_ &&
           std::memcmp(frame.bytes->data(), Expected(camera, set), bytes_) == 0;
  }

 private:
  static constexpr size_t kStarts = 65521;
  static int64_t Time_ns(uint64_t set) { return static_cast<int64_t>(set) * 33'333'333; }
  const uint8_t* Expected(size_t camera, uint64_t set) const {
    return noise_.data() + (set * 8191 + camera * 131) % kStarts;
  }

  const std::vector<std::string> camera_ids_;
  const int width_px_;
  const int height_px_;
  const RawFormat format_;
  const size_t bytes_;
  BufferPool pool_;
  std::vector<uint8_t> noise_;
};

}  // namespace weft
