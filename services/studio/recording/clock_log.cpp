#include "services/studio/recording/clock_log.h"

#include <fcntl.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"

namespace weft {
namespace {

constexpr std::string_view kOldHeading =
    "host_time_ns,camera,device_minus_host_ns,uncertainty_ns,ptp_status,ptp_offset_ns";
constexpr std::string_view kHeading =
    "host_time_ns,camera,device_minus_host_ns,uncertainty_ns,ptp_status,ptp_offset_ns,checksum";
constexpr size_t kChecksumDigits = 16;

constexpr int64_t kSmallestJump_ns = 5'000'000;
constexpr int64_t kDriftDivisor = 1000;  // clocks that PTP steers, too

uint64_t ChecksumOfStart() { return Checksum(kHeading.data(), kHeading.size()); }

// Each line's checksum goes on from that of the line before, so that lines are missed as well.
uint64_t Chained(uint64_t before, std::string_view line) {
  const std::string text = absl::StrCat(absl::Hex(before, absl::kZeroPad16), std::string(line));
  return Checksum(text.data(), text.size());
}

std::string Sealed(const std::string& line, uint64_t& before) {
  before = Chained(before, line);
  return absl::StrCat(line, ",", absl::Hex(before, absl::kZeroPad16), "\n");
}

std::string LineOf(const std::string& camera_id, const ClockReading& reading) {
  return absl::StrCat(reading.host_time_ns, ",", camera_id, ",", reading.device_minus_host_ns, ",",
                      reading.uncertainty_ns, ",", reading.ptp_status, ",",
                      reading.ptp_offset_ns ? absl::StrCat(*reading.ptp_offset_ns) : "");
}

std::string EndLine(uint64_t readings) { return absl::StrCat("end,,", readings, ",,,"); }

std::optional<LoggedReading> ParseLine(std::string_view line) {
  const std::vector<std::string> cells = absl::StrSplit(std::string(line), ',');
  LoggedReading logged;
  ClockReading& reading = logged.reading;
  int64_t offset_ns = 0;
  if (cells.size() != 6 || !absl::SimpleAtoi(cells[0], &reading.host_time_ns) ||
      !absl::SimpleAtoi(cells[2], &reading.device_minus_host_ns) ||
      !absl::SimpleAtoi(cells[3], &reading.uncertainty_ns) ||
      (!cells[5].empty() && !absl::SimpleAtoi(cells[5], &offset_ns)))
    return std::nullopt;
  logged.camera_id = cells[1];
  reading.ptp_status = cells[4];
  if (!cells[5].empty()) reading.ptp_offset_ns = offset_ns;
  return logged;
}

// Takes the checksum off the end of a line.
std::optional<uint64_t> TakeChecksum(std::string_view& line) {
  if (line.size() <= kChecksumDigits || line[line.size() - kChecksumDigits - 1] != ',') return std::nullopt;
  uint64_t value = 0;
  const std::string digits(line.substr(line.size() - kChecksumDigits));
  if (!absl::SimpleHexAtoi(digits, &value) || digits != absl::StrCat(absl::Hex(value, absl::kZeroPad16)))
    return std::nullopt;
  line.remove_suffix(kChecksumDigits + 1);
  return value;
}

class LogParser {
 public:
  explicit LogParser(bool has_checksums) { log_.has_checksums = has_checksums; }

  void Add(std::string_view line, size_t number) {
    const uint64_t readings = log_.readings.size();
    const bool is_right = log_.has_checksums ? AddSealed(line) : AddReading(line);
    if (is_right && !ended_before_) return;
    if (is_right && log_.readings.size() > readings) log_.readings.pop_back();  // it was moved there
    if (log_.damaged_lines++ == 0) log_.damage = absl::StrCat("line ", number, " is not as it was written");
  }
  void Cut(size_t number) {
    log_.is_cut = true;
    if (log_.damaged_lines++ == 0) log_.damage = absl::StrCat("line ", number, " is cut off");
  }
  ParsedClockLog Take() { return std::move(log_); }

 private:
  bool AddReading(std::string_view line) {
    std::optional<LoggedReading> reading = ParseLine(line);
    if (reading) log_.readings.push_back(*std::move(reading));
    return reading.has_value();
  }
  bool AddSealed(std::string_view line) {
    ended_before_ = log_.has_end;
    const std::optional<uint64_t> printed = TakeChecksum(line);
    const uint64_t computed = Chained(before_, line);
    if (!printed || *printed != computed) {
      if (printed) before_ = *printed;  // what follows it may be right
      return false;
    }
    before_ = computed;
    if (line != EndLine(log_.readings.size() + log_.damaged_lines)) return AddReading(line);
    log_.end_checksum = absl::StrCat(absl::Hex(computed, absl::kZeroPad16));
    return log_.has_end = true;
  }

  ParsedClockLog log_;
  uint64_t before_ = ChecksumOfStart();
  bool ended_before_ = false;
};

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
  const MutexLock lock(mutex_);
  WEFT_ASSIGN_OR_RETURN(PosixFile file, PosixFile::Open(ClockLogFile(take), O_RDWR | O_CREAT | O_TRUNC));
  file_.emplace(std::move(file));
  pending_ = std::string(kHeading) + "\n";
  written_bytes_ = readings_ = 0;
  checksum_ = ChecksumOfStart();
  return WritePending();
}

absl::Status ClockLog::WritePending() {
  WEFT_RETURN_IF_ERROR(file_->WriteAt(pending_.data(), pending_.size(), written_bytes_));
  written_bytes_ += pending_.size();
  pending_.clear();
  return absl::OkStatus();
}

void ClockLog::Append(const std::string& line) {
  pending_ += Sealed(line, checksum_);
  WritePending().IgnoreError();  // the next one tries again, and Close says so
}

absl::Status ClockLog::Close() {
  const MutexLock lock(mutex_);
  if (!file_) return absl::OkStatus();
  Append(EndLine(readings_));
  absl::Status status = WritePending();
  // Half of a line may stand beyond, of a write that failed.
  if (status.ok()) status = file_->Truncate(written_bytes_);
  if (status.ok()) status = file_->SyncData();
  file_.reset();
  end_checksum_ = absl::StrCat(absl::Hex(checksum_, absl::kZeroPad16));
  return status;
}

std::string ClockLog::end_checksum() const {
  const MutexLock lock(mutex_);
  return end_checksum_;
}

std::string ClockLog::Add(size_t camera, const ClockReading& reading) {
  const MutexLock lock(mutex_);
  if (is_distrusted_[camera]) return "";
  const std::string before = last_[camera] ? last_[camera]->ptp_status : reading.ptp_status;
  last_[camera] = reading;
  if (file_) {
    ++readings_;
    Append(LineOf(camera_ids_[camera], reading));
  }
  if (before == reading.ptp_status) return "";
  return absl::StrCat("PTP went from ", before, " to ", reading.ptp_status);
}

std::optional<ClockReading> ClockLog::Last(size_t camera) const {
  const MutexLock lock(mutex_);
  return last_[camera];
}

void ClockLog::Distrust(size_t camera) {
  const MutexLock lock(mutex_);
  is_distrusted_[camera] = true;
  last_[camera].reset();
}

absl::StatusOr<ParsedClockLog> ParseClockLog(const std::string& take) {
  WEFT_ASSIGN_OR_RETURN(const PosixFile file, PosixFile::Open(ClockLogFile(take), O_RDONLY));
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, file.ReadAll());
  std::string_view text = bytes;
  const std::string_view heading = text.substr(0, text.find('\n'));
  if (heading != kHeading && heading != kOldHeading)
    return absl::DataLossError(absl::StrCat(ClockLogFile(take), ": is no log of clocks"));
  LogParser parser(heading == kHeading);
  text.remove_prefix(std::min(text.size(), heading.size() + 1));
  for (size_t number = 2; !text.empty(); ++number) {
    const size_t end = text.find('\n');
    if (end == std::string_view::npos) {
      parser.Cut(number);
      break;
    }
    parser.Add(text.substr(0, end), number);
    text.remove_prefix(end + 1);
  }
  return parser.Take();
}

UsableClockLog ReadClockLog(const std::string& take, const ClockLogSeal& seal) {
  absl::StatusOr<ParsedClockLog> log = ParseClockLog(take);
  if (absl::IsNotFound(log.status())) return {{}, seal.checksum.empty() ? "" : "clocks.csv: is missing"};
  if (!log.ok()) return {{}, absl::StrCat("clocks.csv: ", log.status().message())};
  if (!log->MayBeOf(seal.checksum))
    return {{}, "clocks.csv: is not the one that was written with this take, and is not read"};
  // A recorder that was killed may have left half a line, of a version that cannot tell more.
  const bool is_crash = !log->has_checksums && log->is_cut && log->damaged_lines == 1;
  UsableClockLog out;
  if (log->damaged_lines > 0 && !is_crash) {
    out.damage = absl::StrCat("clocks.csv: ", log->damage, ", ", log->damaged_lines,
                              " in all; its other lines are read");
  } else if (seal.is_closed && log->has_checksums && !log->has_end) {
    out.damage = "clocks.csv: has no end: it was cut, or the take was not closed";
  }
  out.readings = std::move(log->readings);
  return out;
}

std::string ClockLogText(const std::vector<LoggedReading>& readings) {
  std::string text = std::string(kHeading) + "\n";
  uint64_t checksum = ChecksumOfStart();
  for (const LoggedReading& logged : readings)
    text += Sealed(LineOf(logged.camera_id, logged.reading), checksum);
  return text + Sealed(EndLine(readings.size()), checksum);
}

}  // namespace weft
