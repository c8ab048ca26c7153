// Dumps that are folders of images: <dump>/<frame>/<camera>.(png|jpg|jpeg|tif|tiff), or
// <dump>/cam<camera>/image<frame>.(png|...).
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"

namespace weft {

struct ImageFolderOptions {
  std::optional<PixelFormat> mosaic;  // set when grey files hold a Bayer mosaic
};

// Lists the dump; images are read by Read. Frames are ordered by name, numbers by value. `warnings()` of
// the result names image files of unknown cameras, cameras of the rig without any image, and what
// ListImageFolder notes. Errors of ListImageFolder; a dump without any frame of a known camera is
// InvalidArgument.
class ImageFolderDump : public FrameSource {
 public:
  static absl::StatusOr<std::unique_ptr<ImageFolderDump>> Open(const std::string& folder, const Rig& rig,
                                                               const ImageFolderOptions& options = {});

  const std::vector<std::string>& frame_names() const override { return frame_names_; }
  absl::StatusOr<FrameSet> Read(size_t index) const override;
  absl::StatusOr<Frame> ReadView(size_t index, size_t camera) const override;
  absl::StatusOr<StoredView> Locate(size_t index, size_t camera) const override;
  absl::StatusOr<Frame> ReadCopy(const std::string& copy, size_t index, size_t camera) const override;
  // Over names, sizes and modification times of the image files.
  absl::StatusOr<std::string> Fingerprint(size_t index) const override;
  const std::vector<std::string>& warnings() const override { return warnings_; }
  std::vector<std::string> unknown_cameras() const override { return unknown_cameras_; }

 private:
  ImageFolderDump() = default;
  // Errors of ReadView.
  absl::StatusOr<std::string> PathOf(size_t index, size_t camera) const;

  Rig rig_;
  ImageFolderOptions options_;
  std::vector<std::string> frame_names_;
  std::vector<std::vector<std::string>> paths_;  // [frame][camera of the rig], empty where there is none
  std::vector<std::string> warnings_, unknown_cameras_;
};

}  // namespace weft
