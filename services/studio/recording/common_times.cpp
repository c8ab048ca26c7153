#include "services/studio/recording/common_times.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

constexpr int64_t kEarliest_ns = -50'000'000;         // of an arrival, by readings that are right
constexpr int64_t kLongestDelay_ns = 10'000'000'000;  // between a frame's time and its arrival
constexpr int64_t kArrivals_ns = 5'000'000'000;       // over which the quickest arrival counts
constexpr int64_t kArrivalScatter_ns = 20'000'000;    // of the quickest

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
      readings_(take.camera_ids().size()),
      usual_lateness_ns_(take.camera_ids().size()) {
  for (const v1::TakeCamera& camera : description.cameras()) {
    const auto& ids = take.camera_ids();
    const auto index = static_cast<size_t>(std::ranges::find(ids, camera.id()) - ids.begin());
    if (index == ids.size()) continue;
    has_own_clock_[index] = camera.own_clock();
    is_unsynchronized_[index] = camera.unsynchronized();
  }
  for (size_t camera = 0; camera < readings_.size(); ++camera) {
    std::vector<const ClockReading*> own;
    for (const LoggedReading& logged : readings)
      if (logged.camera_id == take.camera_ids()[camera]) own.push_back(&logged.reading);
    for (const ClockReading* reading : WithoutSlow(std::move(own)))
      readings_[camera][reading->host_time_ns] = *reading;
    usual_lateness_ns_[camera] = Lateness_ns(camera).value_or(0);
    // None arrived before it was taken, nor long after.
    are_readings_wrong_[camera] =
        usual_lateness_ns_[camera] < kEarliest_ns || usual_lateness_ns_[camera] > kLongestDelay_ns;
    if (are_readings_wrong_[camera]) readings_[camera].clear();
    is_by_arrival_[camera] = readings_[camera].empty() && (own_clocks_ || has_own_clock_[camera]);
    if (!is_by_arrival_[camera]) continue;
    readings_[camera] = Arrivals(camera);
    usual_lateness_ns_[camera] = Lateness_ns(camera).value_or(0);
  }
  for (size_t set = 0; set < take.sets().size(); ++set) {
    const std::vector<int64_t> times_ns = TriggeredTimes_ns(set);
    medians_ns_.push_back(times_ns.empty() ? std::nullopt : std::optional(times_ns[times_ns.size() / 2]));
  }
}

std::optional<int64_t> CommonTimes::Lateness_ns(size_t camera) const {
  std::vector<int64_t> late_ns;
  for (size_t set = 0; set < take_.sets().size(); ++set) {
    const IndexRecord* record = take_.Record(set, camera);
    if (record == nullptr || record->is_missing || record->host_time_ns == 0) continue;
    if (const std::optional<ClockReading> reading = ReadingAt(camera, *record))
      late_ns.push_back(record->host_time_ns - (record->device_time_ns - reading->device_minus_host_ns));
  }
  return late_ns.empty() ? std::nullopt : std::optional(Median(std::move(late_ns)));
}

CommonTimes::Readings CommonTimes::Arrivals(size_t camera) const {
  Readings readings;
  const IndexRecord* quickest = nullptr;
  int64_t since_ns = 0;
  const auto end_window = [&] {
    if (quickest != nullptr)
      readings[quickest->host_time_ns] = {quickest->host_time_ns,
                                          quickest->device_time_ns - quickest->host_time_ns,
                                          kArrivalScatter_ns,
                                          "",
                                          {}};
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
  std::ranges::sort(found);
  return found;
}

// Between two readings the clock ran evenly, or it jumped: then the one counts with which the frame came as
// late as others do.
std::optional<ClockReading> CommonTimes::ReadingAt(size_t camera, const IndexRecord& record) const {
  const Readings& readings = readings_[camera];
  if (readings.empty()) return std::nullopt;
  const auto next = readings.upper_bound(record.host_time_ns);
  if (next == readings.begin()) return next->second;
  const ClockReading& before = std::prev(next)->second;
  if (next == readings.end()) return before;
  const ClockReading& after = next->second;
  if (!IsClockJump(before, after)) {
    const double part = static_cast<double>(record.host_time_ns - before.host_time_ns) /
                        static_cast<double>(after.host_time_ns - before.host_time_ns);
    ClockReading between = before;
    between.device_minus_host_ns +=
        std::llround(part * static_cast<double>(after.device_minus_host_ns - before.device_minus_host_ns));
    return between;
  }
  const auto unusual_ns = [&](const ClockReading& reading) {
    const int64_t taken_ns = record.device_time_ns - reading.device_minus_host_ns;
    return std::abs(record.host_time_ns - taken_ns - usual_lateness_ns_[camera]);
  };
  return unusual_ns(before) < unusual_ns(after) ? before : after;
}

std::optional<int64_t> CommonTimes::Time_ns(size_t set, size_t camera) const {
  const IndexRecord* record = take_.Record(set, camera);
  if (record == nullptr || record->is_missing) return std::nullopt;
  const std::optional<ClockReading> own = ReadingAt(camera, *record);
  if (!own) return record->device_time_ns;
  if (own_clocks_) return record->device_time_ns - own->device_minus_host_ns;
  // What most cameras say is the common clock.
  std::vector<int64_t> all_ns;
  for (size_t other = 0; other < readings_.size(); ++other) {
    if (has_own_clock_[other]) continue;
    if (const std::optional<ClockReading> one = ReadingAt(other, *record))
      all_ns.push_back(one->device_minus_host_ns);
  }
  if (all_ns.empty()) return record->device_time_ns - own->device_minus_host_ns;
  ClockReading common = *own;
  common.device_minus_host_ns = Median(std::move(all_ns));
  const bool differs = has_own_clock_[camera] || IsClockJump(common, *own);
  return record->device_time_ns - (differs ? own->device_minus_host_ns - common.device_minus_host_ns : 0);
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
