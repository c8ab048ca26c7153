// The cloth of a take in one file, frame by frame: truth without pictures (layout: docs/file-formats.md).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "figure/pose.h"

namespace weft {

// What all frames have in common.
struct FramesHead {
  std::string template_hash;  // content hash of the template whose vertices these are; up to 255 bytes
  uint32_t vertices = 0;
  double fps = 30;
  bool has_pose = false;  // of the person who wears the cloth
};

struct ClothFrame {
  int64_t time_ns = 0;
  std::vector<Eigen::Vector3d> vertices_mm;  // [vertices]
  std::optional<FigurePose> pose;            // where the head says so
};

// Positions to 1/64 mm, where the cloth is wider than a metre to 1/32 mm and so on. All frames have the same
// size.
std::string EncodeFramesHead(const FramesHead& head);
// Errors name source_name: InvalidArgument for what is no head.
absl::StatusOr<FramesHead> DecodeFramesHead(std::string_view bytes, const std::string& source_name);
size_t FramesHeadBytes(const FramesHead& head);

size_t ClothFrameBytes(const FramesHead& head);
std::string EncodeClothFrame(const FramesHead& head, const ClothFrame& frame);
// DataLoss when the checksum does not match; InvalidArgument for another size.
absl::StatusOr<ClothFrame> DecodeClothFrame(const FramesHead& head, std::string_view bytes,
                                            const std::string& source_name);

// Reads any frame of a file. Not for use by two threads at once.
class FramesReader {
 public:
  // NotFound, InvalidArgument (no frames file; a rest that is no whole frame is left out when `unfinished`).
  static absl::StatusOr<FramesReader> Open(const std::string& path, bool unfinished = false);

  const FramesHead& head() const { return head_; }
  int frames() const { return frames_; }
  // OutOfRange beyond the last; DataLoss names file and frame.
  absl::StatusOr<ClothFrame> Read(int frame);

 private:
  std::string path_;
  std::ifstream file_;
  FramesHead head_;
  int frames_ = 0;
};

}  // namespace weft
