// When the frames of a recorded take were taken, on one time axis for all cameras.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/take/recorded_take.h"
#include "services/studio/recording/clock_log.h"
#include "weft/v1/take.pb.h"

namespace weft {

// Mean and scatter of numbers that come one by one.
struct Spread {
  uint64_t count = 0;
  double sum = 0, squares = 0, worst = 0;

  void Add(double value) {
    ++count;
    sum += value;
    squares += value * value;
    worst = std::max(worst, std::abs(value));
  }
  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
  double rms() const { return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0; }
  double deviation() const { return std::sqrt(std::max(0.0, rms() * rms() - mean() * mean())); }
};

// Device times of synchronized clocks compare directly, except for clocks that jumped. Other clocks are
// converted to the host's by their readings. Where the clock was not read or contradicts its frames, the
// earliest arrivals are used. Synchronized clocks without readings: device times unchanged.
class CommonTimes {
 public:
  // `description`: of the take, says which cameras have clocks of their own or are unsynchronized.
  CommonTimes(const RecordedTake& take, const std::vector<LoggedReading>& readings,
              const v1::Take& description);

  // Nothing where the camera has no frame in the set at this index.
  std::optional<int64_t> Time_ns(size_t set, size_t camera) const;
  // The middle one of the times of the synchronized cameras,
  // where one has a frame; nothing where no camera has one.
  std::optional<int64_t> Median_ns(size_t set) const { return medians_ns_[set]; }
  // There were readings of its clock, and its frames contradict them: none of them counts.
  bool AreReadingsWrong(size_t camera) const { return are_readings_wrong_[camera]; }
  // Between the first and the last of these cameras.
  std::optional<int64_t> Spread_ns(size_t set) const;

 private:
  using Readings = std::map<int64_t, ClockReading>;  // by host time

  std::optional<ClockReading> ReadingAt(size_t camera, const IndexRecord& record) const;
  // How long after its time by the readings the middle one of its frames arrived.
  std::optional<int64_t> Lateness_ns(size_t camera) const;
  Readings Arrivals(size_t camera) const;
  std::vector<int64_t> TriggeredTimes_ns(size_t set) const;

  const RecordedTake& take_;
  bool own_clocks_;                                      // of all
  std::vector<bool> has_own_clock_, is_unsynchronized_;  // by camera
  std::vector<bool> is_by_arrival_, are_readings_wrong_;
  std::vector<Readings> readings_;          // of each camera
  std::vector<int64_t> usual_lateness_ns_;  // of each camera's frames
  std::vector<std::optional<int64_t>> medians_ns_;
};

// Fills `timing` and `duration_s`.
void DescribeTiming(const RecordedTake& take, const CommonTimes& times, v1::TakeInfo& info);

}  // namespace weft
