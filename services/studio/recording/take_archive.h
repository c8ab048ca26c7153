// Takes as lossless videos, for the archive.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "services/studio/recording/take_copy.h"

namespace weft {

// Writes per camera <out>/<camera>.mkv, lossless FFV1, and <out>/<camera>.csv, which maps frames of the
// video to frame sets, with times. take.json, ledger.csv and clocks.csv are copied. The pixels are those
// of the camera: mosaics stay mosaics, 10 and 12 bits in 16 stay so, and packed pixels are written as an
// image of their bytes. Every video is decoded and compared with the take, byte by byte, before it is
// renamed to its final name. Progress counts frames, once written and once read back. Returns the number
// of frames. InvalidArgument: motion JPEG, frames that change their size; nothing is written then.
// NotFound: no ffmpeg. DataLoss: a damaged take, or a video that does not give back what went in.
absl::StatusOr<uint64_t> ExportArchive(const std::string& take, const std::string& out,
                                       const CopyProgress& progress = nullptr);

}  // namespace weft
