#include "capture/take/take_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"

namespace weft {

int64_t PeriodOf_ns(const RecordedTake& take) {
  std::vector<int64_t> intervals_ns;
  for (size_t camera = 0; camera < take.camera_ids().size(); ++camera) {
    const IndexRecord* last = nullptr;
    for (const IndexRecord& record : take.stream(camera).records()) {
      if (record.is_missing) continue;
      if (last != nullptr && record.set > last->set)
        intervals_ns.push_back((record.device_time_ns - last->device_time_ns) /
                               static_cast<int64_t>(record.set - last->set));
      last = &record;
    }
  }
  if (intervals_ns.empty()) return 0;
  return std::max<int64_t>(Median(std::move(intervals_ns)), 0);
}

absl::StatusOr<TakeView> TakeView::Open(const std::string& folder, const TakeViewOptions& options) {
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<RecordedTake> take, RecordedTake::Open(folder));
  TakeView view;
  view.take_ = std::move(take);
  const std::vector<std::string>& ids = view.take_->camera_ids();
  view.shift_ns_.resize(ids.size());
  view.shift_sets_.resize(ids.size());
  const int64_t period_ns = options.shift_ns.empty() ? 0 : PeriodOf_ns(*view.take_);
  for (const auto& [id, shift_ns] : options.shift_ns) {
    const auto at = std::find(ids.begin(), ids.end(), id);
    if (at == ids.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat(folder, ": has no camera ", id, " whose times could be shifted"));
    }
    const auto camera = static_cast<size_t>(at - ids.begin());
    view.shift_ns_[camera] = shift_ns;
    if (period_ns > 0)
      view.shift_sets_[camera] = std::llround(static_cast<double>(shift_ns) / static_cast<double>(period_ns));
  }
  const std::vector<uint64_t>& sets = view.take_->sets();
  view.sets_.assign(std::lower_bound(sets.begin(), sets.end(), options.first_set),
                    options.first_set > options.last_set
                        ? std::lower_bound(sets.begin(), sets.end(), options.first_set)
                        : std::upper_bound(sets.begin(), sets.end(), options.last_set));
  if (!view.sets_.empty()) return view;
  return absl::InvalidArgumentError(
      absl::StrCat(folder, ": has no frame set from ", options.first_set, " to ", options.last_set,
                   sets.empty() ? "" : absl::StrCat("; it holds ", sets.front(), " to ", sets.back())));
}

const IndexRecord* TakeView::Record(size_t index, size_t camera) const {
  // Numbers below the shift wrap around and are found nowhere.
  const uint64_t recorded = sets_[index] - static_cast<uint64_t>(shift_sets_[camera]);
  const std::vector<uint64_t>& sets = take_->sets();
  const auto at = std::lower_bound(sets.begin(), sets.end(), recorded);
  if (at == sets.end() || *at != recorded) return nullptr;
  return take_->Record(static_cast<size_t>(at - sets.begin()), camera);
}

absl::StatusOr<RawFrame> TakeView::ReadRaw(size_t index, size_t camera) const {
  if (index >= sets_.size() || camera >= shift_ns_.size()) {
    return absl::OutOfRangeError(absl::StrCat("frame set ", index, " of ", sets_.size(), ", camera ", camera,
                                              " of ", shift_ns_.size()));
  }
  const IndexRecord* record = Record(index, camera);
  if (record == nullptr) {
    return absl::NotFoundError(shift_sets_[camera] != 0 ? "the shifted stream has no frame for this set"
                                                        : "the stream lacks this frame set");
  }
  absl::StatusOr<RawFrame> frame = take_->stream(camera).Read(*record);
  if (!frame.ok()) return frame;
  frame->device_time_ns += shift_ns_[camera];
  if (frame->host_time_ns != 0) frame->host_time_ns += shift_ns_[camera];
  return frame;
}

absl::StatusOr<RawFrameSet> TakeView::ReadSet(size_t index) const {
  if (index >= sets_.size())
    return absl::OutOfRangeError(absl::StrCat("frame set ", index, " of ", sets_.size()));
  RawFrameSet set;
  set.number = sets_[index];
  for (size_t camera = 0; camera < shift_ns_.size(); ++camera) {
    absl::StatusOr<RawFrame> frame = ReadRaw(index, camera);
    if (frame.ok()) {
      if (set.frames.empty()) set.device_time_ns = frame->device_time_ns;
      set.frames.push_back(*std::move(frame));
    } else {
      set.missing.push_back({take_->camera_ids()[camera], std::string(frame.status().message())});
    }
  }
  return set;
}

std::optional<int64_t> TakeView::Time_ns(size_t index, size_t camera) const {
  const IndexRecord* record = Record(index, camera);
  if (record == nullptr || record->is_missing) return std::nullopt;
  return (record->host_time_ns != 0 ? record->host_time_ns : record->device_time_ns) + shift_ns_[camera];
}

}  // namespace weft
