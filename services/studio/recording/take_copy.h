// Takes made from other recordings: folders of images in and out, parts of takes.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "capture/take/frame_times.h"
#include "capture/take/take_view.h"
#include "services/studio/recording/recorder.h"

namespace weft {

// After each frame set: done, of how many.
using CopyProgress = std::function<void(uint64_t done, uint64_t total)>;

struct TakeCopyOptions {
  RecorderOptions recorder;
  std::optional<PixelFormat> mosaic;  // of grey images
  double fps = 0;                     // images carry no time; at 0 their device times stay 0
  NameMeaning names = NameMeaning::kAuto;
};

struct ImportedImages {
  uint64_t sets = 0;
  std::vector<std::string> notes;  // as ImageFolder has them, and of names that are times
};

// A folder of images (ListImageFolder) becomes a take, bit by bit: 8-bit pixels as they are decoded from the
// files. A frame whose name has a number keeps it, and names that are times (TimesInNames) give the times of
// the sets. Images that cannot be read, or have another size than most of their camera, are missing, with the
// reason. Notes stand in the ledger, too; the last ones say how many are missing. DataLoss: no image could be
// read, and no take is left. Errors of ListImageFolder, FindOddPictures and TimesInNames; InvalidArgument: a
// rate at which a number is beyond the times of a take.
absl::StatusOr<ImportedImages> ImportImages(const std::string& images, const std::string& out,
                                            const TakeCopyOptions& options,
                                            const CopyProgress& progress = nullptr);

// The take as images, <out>/<frame>/<camera>.png: 8 bits as `weft register` sees them, or, with `demosaic`,
// RGB.
absl::StatusOr<uint64_t> ExportImages(const std::string& take, const std::string& out, bool demosaic,
                                      const CopyProgress& progress = nullptr);

struct TrimOptions {
  TakeViewOptions view;  // the range, and shifts of cameras
  RecorderOptions recorder;
};

// Copies the frame sets of a range to a new take. Numbers, times and bytes are kept, and so are the
// ledger's lines on dropped sets and the readings of the clocks. Errors of TakeView.
absl::StatusOr<uint64_t> TrimTake(const std::string& take, const std::string& out, const TrimOptions& options,
                                  const CopyProgress& progress = nullptr);

}  // namespace weft
