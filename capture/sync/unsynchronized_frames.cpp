#include "capture/sync/unsynchronized_frames.h"

#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr int kMostMisses = 3;  // in a row; then the count says nothing any more

}  // namespace

void UnsynchronizedFrames::Add(RawFrame frame, int64_t time_ns) {
  newest_id_ = frame.device_frame_id;
  newest_ns_ = time_ns;
  waiting_.push_back({std::move(frame), time_ns});
  if (waiting_.size() > kMaxWaiting) LeaveFirst();
}

void UnsynchronizedFrames::Restart() {
  while (!waiting_.empty()) LeaveFirst();
  last_.reset();
  newest_id_.reset();
}

uint64_t UnsynchronizedFrames::ExpectedId(int64_t trigger_ns) const {
  return last_->id + static_cast<uint64_t>((trigger_ns - last_->trigger_ns + period_ns_ / 2) / period_ns_);
}

std::optional<size_t> UnsynchronizedFrames::Find(uint64_t id) const {
  for (size_t i = 0; i < waiting_.size(); ++i)
    if (waiting_[i].frame.device_frame_id == id) return i;
  return std::nullopt;
}

bool UnsynchronizedFrames::IsNear(size_t index, int64_t trigger_ns) const {
  return std::abs(waiting_[index].time_ns - trigger_ns) <= period_ns_ / 4 * 3;
}

std::optional<size_t> UnsynchronizedFrames::Nearest(int64_t trigger_ns) const {
  const auto distance_ns = [&](size_t i) { return std::abs(waiting_[i].time_ns - trigger_ns); };
  std::optional<size_t> best;
  for (size_t i = 0; i < waiting_.size(); ++i)
    if (distance_ns(i) <= period_ns_ / 2 && (!best || distance_ns(i) < distance_ns(*best))) best = i;
  return best;
}

bool UnsynchronizedFrames::Knows(int64_t trigger_ns) const {
  if (!newest_id_) return false;
  if (newest_ns_ >= trigger_ns + period_ns_) return true;
  if (!last_) return newest_ns_ >= trigger_ns;
  const std::optional<size_t> expected = Find(ExpectedId(trigger_ns));
  if (expected && !IsNear(*expected, trigger_ns)) return newest_ns_ >= trigger_ns;
  return *newest_id_ >= ExpectedId(trigger_ns);
}

void UnsynchronizedFrames::LeaveFirst() {
  last_left_id_ = waiting_.front().frame.device_frame_id;
  if (left_over_++ == 0) first_left_id_ = last_left_id_;
  waiting_.pop_front();
}

std::optional<RawFrame> UnsynchronizedFrames::Take(int64_t trigger_ns) {
  while (!waiting_.empty() && waiting_.front().time_ns < trigger_ns - period_ns_) LeaveFirst();
  std::optional<size_t> index = last_ ? Find(ExpectedId(trigger_ns)) : Nearest(trigger_ns);
  if (index && !IsNear(*index, trigger_ns)) {
    last_.reset();
    index = Nearest(trigger_ns);
  }
  if (!index) {
    if (++misses_ >= kMostMisses) last_.reset();
    return std::nullopt;
  }
  misses_ = 0;
  for (size_t i = 0; i < *index; ++i) LeaveFirst();
  RawFrame frame = std::move(waiting_.front().frame);
  last_ = {frame.device_frame_id, trigger_ns, waiting_.front().time_ns - trigger_ns};
  waiting_.pop_front();
  return frame;
}

std::string UnsynchronizedFrames::TakeLeftOver() {
  if (left_over_ == 0) return "";
  const uint64_t count = std::exchange(left_over_, 0);
  if (count == 1)
    return absl::StrCat("its frame ", first_left_id_, " is nearest to no trigger and in no frame set");
  return absl::StrCat("its frames ", first_left_id_, " to ", last_left_id_, " (", count,
                      ") are nearest to no trigger and in no frame set");
}

}  // namespace weft
