#include "services/recording/common_times.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

// Synchronized clocks that differ by more than readings are wrong have jumped.
constexpr int64_t kJumped_ns = 50'000'000;

constexpr int64_t kLongestDelay_ns = 10'000'000'000;  // between a frame's time and its arrival
constexpr int64_t kArrivals_ns = 5'000'000'000;       // over which the quickest arrival counts

// Answers that took much longer than most say little.
std::vector<const ClockReading*> WithoutSlow(std::vector<const ClockReading*> readings) {
  if (readings.empty()) return readings;
  std::vector<int64_t> uncertainties_ns;
  for (const ClockReading* reading : readings) uncertainties_ns.push_back(reading->uncertainty_ns);
  const int64_t limit_ns = 4 * Median(std::move(uncertainties_ns));
  std::erase_if(readings, [&](const ClockReading* reading) { return reading->uncertainty_ns > limit_ns; });
  return readings;
}

}  // namespace

CommonTimes::CommonTimes(const RecordedTake& take, const std::vector<LoggedReading>& readings,
                         const v1::Take& description)
    : take_(take),
      own_clocks_(description.own_clocks()),
      has_own_clock_(take.camera_ids().size()),
      is_unsynchronized_(take.camera_ids().size()),
      is_by_arrival_(take.camera_ids().size()),
      are_readings_wrong_(take.camera_ids().size()),
      readings_(take.camera_ids().size()) {
  for (const v1::TakeCamera& camera : description.cameras()) {
    const auto& ids = take.camera_ids();
    const auto index = static_cast<size_t>(std::find(ids.begin(), ids.end(), camera.id()) - ids.begin());
    if (index == ids.size()) continue;
    has_own_clock_[index] = camera.own_clock();
    is_unsynchronized_[index] = camera.unsynchronized();
  }
  for (size_t camera = 0; camera < readings_.size(); ++camera) {
    std::vector<const ClockReading*> own;
    for (const LoggedReading& logged : readings)
      if (logged.camera_id == take.camera_ids()[camera]) own.push_back(&logged.reading);
    for (const ClockReading* reading : WithoutSlow(std::move(own)))
      readings_[camera][reading->host_time_ns] = reading->device_minus_host_ns;
    are_readings_wrong_[camera] = !AgreesWithFrames(camera);
    if (are_readings_wrong_[camera]) readings_[camera].clear();
    is_by_arrival_[camera] = readings_[camera].empty() && (own_clocks_ || has_own_clock_[camera]);
    if (is_by_arrival_[camera]) readings_[camera] = Arrivals(camera);
  }
  for (size_t set = 0; set < take.sets().size(); ++set) {
    const std::vector<int64_t> times_ns = TriggeredTimes_ns(set);
    medians_ns_.push_back(times_ns.empty() ? std::nullopt : std::optional(times_ns[times_ns.size() / 2]));
  }
}

// By the middle one of its frames none arrived before it was taken, nor long after.
bool CommonTimes::AgreesWithFrames(size_t camera) const {
  std::vector<int64_t> late_ns;
  for (size_t set = 0; set < take_.sets().size(); ++set) {
    const IndexRecord* record = take_.Record(set, camera);
    if (record == nullptr || record->is_missing || record->host_time_ns == 0) continue;
    if (const std::optional<int64_t> minus_host_ns = MinusHost_ns(readings_[camera], *record))
      late_ns.push_back(record->host_time_ns - (record->device_time_ns - *minus_host_ns));
  }
  if (late_ns.empty()) return true;
  const int64_t median_ns = Median(std::move(late_ns));
  return median_ns >= -kJumped_ns && median_ns <= kLongestDelay_ns;
}

CommonTimes::Readings CommonTimes::Arrivals(size_t camera) const {
  Readings readings;
  const IndexRecord* quickest = nullptr;
  int64_t since_ns = 0;
  const auto end_window = [&] {
    if (quickest != nullptr)
      readings[quickest->host_time_ns] = quickest->device_time_ns - quickest->host_time_ns;
    quickest = nullptr;
  };
  for (size_t set = 0; set < take_.sets().size(); ++set) {
    const IndexRecord* record = take_.Record(set, camera);
    if (record == nullptr || record->is_missing || record->host_time_ns == 0) continue;
    if (quickest != nullptr && record->host_time_ns - since_ns > kArrivals_ns) end_window();
    if (quickest == nullptr) since_ns = record->host_time_ns;
    if (quickest == nullptr ||
        record->device_time_ns - record->host_time_ns > quickest->device_time_ns - quickest->host_time_ns)
      quickest = record;
  }
  end_window();
  return readings;
}

std::vector<int64_t> CommonTimes::TriggeredTimes_ns(size_t set) const {
  std::vector<int64_t> found, others;
  for (size_t camera = 0; camera < readings_.size(); ++camera)
    if (const std::optional<int64_t> time_ns = Time_ns(set, camera))
      (is_unsynchronized_[camera] ? others : found).push_back(*time_ns);
  if (found.empty()) found.swap(others);
  std::sort(found.begin(), found.end());
  return found;
}

// Between two readings the clock ran evenly, or it jumped: then the one counts with which the frame was not
// taken after it arrived, or long before.
std::optional<int64_t> CommonTimes::MinusHost_ns(const Readings& readings, const IndexRecord& record) {
  if (readings.empty()) return std::nullopt;
  const auto after = readings.upper_bound(record.host_time_ns);
  if (after == readings.begin()) return after->second;
  const auto before = std::prev(after);
  if (after == readings.end()) return before->second;
  if (std::abs(after->second - before->second) < kJumped_ns) {
    const double part = static_cast<double>(record.host_time_ns - before->first) /
                        static_cast<double>(after->first - before->first);
    return before->second + std::llround(part * static_cast<double>(after->second - before->second));
  }
  const auto lateness_ns = [&](int64_t minus_host_ns) {
    return std::abs(record.host_time_ns - (record.device_time_ns - minus_host_ns));
  };
  return lateness_ns(before->second) < lateness_ns(after->second) ? before->second : after->second;
}

std::optional<int64_t> CommonTimes::Time_ns(size_t set, size_t camera) const {
  const IndexRecord* record = take_.Record(set, camera);
  if (record == nullptr || record->is_missing) return std::nullopt;
  const std::optional<int64_t> own_ns = MinusHost_ns(readings_[camera], *record);
  if (!own_ns) return record->device_time_ns;
  if (own_clocks_) return record->device_time_ns - *own_ns;
  // What most cameras say is the common clock.
  std::vector<int64_t> all_ns;
  for (size_t other = 0; other < readings_.size(); ++other) {
    if (has_own_clock_[other]) continue;
    if (const std::optional<int64_t> one_ns = MinusHost_ns(readings_[other], *record))
      all_ns.push_back(*one_ns);
  }
  if (all_ns.empty()) return record->device_time_ns - *own_ns;
  const int64_t off_ns = *own_ns - Median(std::move(all_ns));
  return record->device_time_ns - (has_own_clock_[camera] || std::abs(off_ns) > kJumped_ns ? off_ns : 0);
}

std::optional<int64_t> CommonTimes::Spread_ns(size_t set) const {
  const std::vector<int64_t> times_ns = TriggeredTimes_ns(set);
  if (times_ns.empty()) return std::nullopt;
  return times_ns.back() - times_ns.front();
}

void DescribeTiming(const RecordedTake& take, const CommonTimes& times, v1::TakeInfo& info) {
  for (size_t camera = 0; camera < take.camera_ids().size(); ++camera) {
    Spread intervals_ms, offsets_ms;
    v1::TakeTiming& timing = *info.add_timing();
    timing.set_camera(take.camera_ids()[camera]);
    std::optional<int64_t> before_ns;
    for (size_t set = 0; set < take.sets().size(); ++set) {
      const std::optional<int64_t> time_ns = times.Time_ns(set, camera);
      const bool follows = set > 0 && take.sets()[set - 1] + 1 == take.sets()[set];
      if (time_ns) {
        timing.set_frames(timing.frames() + 1);
        offsets_ms.Add(static_cast<double>(*time_ns - *times.Median_ns(set)) / 1e6);
        if (before_ns && follows) intervals_ms.Add(static_cast<double>(*time_ns - *before_ns) / 1e6);
      } else {
        timing.set_missing(timing.missing() + 1);
      }
      before_ns = time_ns;
    }
    timing.set_interval_mean_ms(intervals_ms.mean());
    timing.set_interval_jitter_ms(intervals_ms.deviation());
    timing.set_offset_mean_ms(offsets_ms.mean());
    timing.set_offset_jitter_ms(offsets_ms.deviation());
    timing.set_offset_worst_ms(offsets_ms.worst);
  }
  std::optional<int64_t> first_ns, last_ns;
  for (size_t set = 0; set < take.sets().size(); ++set) {
    if (!times.Median_ns(set)) continue;
    if (!first_ns) first_ns = times.Median_ns(set);
    last_ns = times.Median_ns(set);
  }
  if (first_ns) info.set_duration_s(static_cast<double>(*last_ns - *first_ns) / 1e9);
}

}  // namespace weft
