#include "services/recording/clock_log.h"

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

constexpr const char* kHeading =
    "host_time_ns,camera,device_minus_host_ns,uncertainty_ns,ptp_status,ptp_offset_ns";

constexpr int64_t kSmallestJump_ns = 5'000'000;
constexpr int64_t kDriftDivisor = 1000;  // clocks that PTP steers, too

}  // namespace

bool IsClockJump(const ClockReading& before, const ClockReading& after) {
  const int64_t step_ns = after.device_minus_host_ns - before.device_minus_host_ns;
  return std::abs(step_ns) > kSmallestJump_ns + before.uncertainty_ns + after.uncertainty_ns +
                                 std::abs(after.host_time_ns - before.host_time_ns) / kDriftDivisor;
}

std::string ClockLogFile(const std::string& take) {
  return (std::filesystem::path(take) / "clocks.csv").string();
}

absl::Status ClockLog::Open(const std::string& take) {
  const std::lock_guard lock(mutex_);
  file_.open(ClockLogFile(take));
  file_ << kHeading << std::endl;
  if (file_) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(ClockLogFile(take), ": cannot be written"));
}

std::string ClockLog::Add(size_t camera, const ClockReading& reading) {
  const std::lock_guard lock(mutex_);
  if (is_distrusted_[camera]) return "";
  const std::string before = last_[camera] ? last_[camera]->ptp_status : reading.ptp_status;
  last_[camera] = reading;
  if (file_.is_open()) {
    file_ << reading.host_time_ns << ',' << camera_ids_[camera] << ',' << reading.device_minus_host_ns << ','
          << reading.uncertainty_ns << ',' << reading.ptp_status << ','
          << (reading.ptp_offset_ns ? absl::StrCat(*reading.ptp_offset_ns) : "") << std::endl;
  }
  if (before == reading.ptp_status) return "";
  return absl::StrCat("PTP went from ", before, " to ", reading.ptp_status);
}

std::optional<ClockReading> ClockLog::Last(size_t camera) const {
  const std::lock_guard lock(mutex_);
  return last_[camera];
}

void ClockLog::Distrust(size_t camera) {
  const std::lock_guard lock(mutex_);
  is_distrusted_[camera] = true;
  last_[camera].reset();
}

absl::StatusOr<std::vector<LoggedReading>> ReadClockLog(const std::string& take) {
  std::ifstream file(ClockLogFile(take));
  std::string line;
  if (!std::getline(file, line) || line != kHeading)
    return absl::NotFoundError(absl::StrCat(ClockLogFile(take), ": missing, or not a log of clocks"));
  std::vector<LoggedReading> readings;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = absl::StrSplit(line, ',');
    LoggedReading logged;
    ClockReading& reading = logged.reading;
    if (cells.size() != 6 || !absl::SimpleAtoi(cells[0], &reading.host_time_ns) ||
        !absl::SimpleAtoi(cells[2], &reading.device_minus_host_ns) ||
        !absl::SimpleAtoi(cells[3], &reading.uncertainty_ns)) {
      continue;
    }
    logged.camera_id = cells[1];
    reading.ptp_status = cells[4];
    int64_t offset_ns = 0;
    if (absl::SimpleAtoi(cells[5], &offset_ns)) reading.ptp_offset_ns = offset_ns;
    readings.push_back(std::move(logged));
  }
  return readings;
}

}  // namespace weft
