#include "services/studio/recording/disk_check.h"

#include <algorithm>
#include <map>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kSpare = 1.25;
constexpr const char* kRemedy =
    "a faster disk, fewer frames a second, a smaller image, 8 bits instead of 12, or `compress`";

}  // namespace

std::optional<double> DataRate_bytes_per_s(const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                           const LiveRecordingOptions& options) {
  if (options.sets.period_ns <= 0) return std::nullopt;
  double bytes = 0;
  for (const auto& camera : cameras) {
    std::map<std::string, std::string> settings = camera->settings();
    int width_px = 0, height_px = 0;
    const absl::StatusOr<RawFormat> format = RawFormatFromName(settings["PixelFormat"]);
    const bool known = format.ok() && absl::SimpleAtoi(settings["Width"], &width_px) &&
                       absl::SimpleAtoi(settings["Height"], &height_px);
    const uint64_t frame_bytes = known ? RawBytes(*format, width_px, height_px) : 0;
    if (frame_bytes == 0) return std::nullopt;
    bytes += static_cast<double>(frame_bytes);
  }
  return bytes * 1e9 / static_cast<double>(options.sets.period_ns);
}

uint64_t DiskTestBytes(double bytes_per_s) {
  return static_cast<uint64_t>(std::clamp(bytes_per_s, 16.0 * (1 << 20), 1024.0 * (1 << 20)));
}

absl::StatusOr<std::vector<std::string>> AssessDisk(const DiskSpeed& speed, double bytes_per_s,
                                                    const LiveRecordingOptions& options) {
  std::vector<std::string> warnings;
  const std::string rates = absl::StrFormat("the cameras send %.3f GB/s, the disk takes %.3f GB/s",
                                            bytes_per_s / 1e9, speed.bytes_per_s / 1e9);
  if (bytes_per_s > speed.bytes_per_s) {
    const double full_s =
        static_cast<double>(options.recorder.queue_bytes) / (bytes_per_s - speed.bytes_per_s);
    const std::string what =
        absl::StrFormat("%s: the queue of %d MiB would be full after %.1f s and frame sets dropped", rates,
                        options.recorder.queue_bytes >> 20, full_s);
    if (!options.recorder.take.stream.compress)
      return absl::FailedPreconditionError(absl::StrCat(what, "; remedy: ", kRemedy));
    warnings.push_back(absl::StrCat(what, ", if the streams were not compressed"));
  } else if (bytes_per_s * kSpare > speed.bytes_per_s) {
    warnings.push_back(absl::StrCat(rates, ": little to spare when it stalls; better ", kRemedy));
  }
  const double free_bytes =
      static_cast<double>(speed.free_bytes) - static_cast<double>(options.recorder.low_disk_bytes);
  if (free_bytes <= 0) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "only %.2f GB are free, and recording stops at the low-disk mark of %.2f GB; make room "
        "on the disk, or lower `low_disk_gib` of the session",
        static_cast<double>(speed.free_bytes) / 1e9,
        static_cast<double>(options.recorder.low_disk_bytes) / 1e9));
  }
  if (options.seconds > 0 && bytes_per_s * options.seconds > free_bytes) {
    warnings.push_back(
        absl::StrFormat("the disk has room for %.0f s of the %.0f s: the take will end early, whole, at "
                        "the low-disk mark; make room",
                        free_bytes / bytes_per_s, options.seconds));
  }
  return warnings;
}

absl::StatusOr<std::vector<std::string>> TestDisk(const std::string& folder,
                                                  const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                                  const LiveRecordingOptions& options,
                                                  const std::string& no_test) {
  const std::optional<double> rate = DataRate_bytes_per_s(cameras, options);
  if (!rate) return std::vector<std::string>();
  WEFT_ASSIGN_OR_RETURN(const DiskSpeed speed, MeasureDiskSpeed(folder, DiskTestBytes(*rate)));
  absl::StatusOr<std::vector<std::string>> warnings = AssessDisk(speed, *rate, options);
  if (warnings.ok()) return warnings;
  return absl::Status(warnings.status().code(), absl::StrCat(folder, ": ", warnings.status().message(), "; ",
                                                             no_test, " records all the same"));
}

}  // namespace weft
