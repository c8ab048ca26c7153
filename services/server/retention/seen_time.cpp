#include "services/server/retention/seen_time.h"

#include <algorithm>
#include <utility>

namespace weft {
namespace {

int64_t EndSeen(const SeenTime::Period& period) {
  return period.begin_seen_ns + (period.end_unix_ns - period.begin_unix_ns);
}

}  // namespace

SeenTime::SeenTime(std::vector<Period> earlier) : periods_(std::move(earlier)) {
  // What a file says is not believed where time would go back.
  std::erase_if(periods_, [](const Period& period) { return period.end_unix_ns < period.begin_unix_ns; });
  for (Period& period : periods_) {
    period.begin_seen_ns = std::max(period.begin_seen_ns, seen_ns_);
    seen_ns_ = EndSeen(period);
  }
}

void SeenTime::Begin(int64_t unix_ns) {
  if (periods_.size() >= kMostPeriods) periods_.erase(periods_.begin());
  periods_.push_back({unix_ns, unix_ns, seen_ns_});
}

SeenTime::Look SeenTime::Advance(int64_t unix_ns, int64_t monotonic_ns) {
  Look look;
  if (!looked_) {
    look.first = true;
    Begin(unix_ns);
  } else {
    const int64_t passed_ns = monotonic_ns - last_monotonic_ns_;
    seen_ns_ += std::clamp<int64_t>(passed_ns, 0, kLongestLook_ns);
    Period& period = periods_.back();
    // From the period's begin, so that many small corrections are one jump in the end.
    const int64_t drift_ns = (unix_ns - period.begin_unix_ns) - (seen_ns_ - period.begin_seen_ns);
    if (std::llabs(drift_ns) <= kSmallestJump_ns) {
      period.end_unix_ns =
          std::max(period.end_unix_ns, period.begin_unix_ns + seen_ns_ - period.begin_seen_ns);
    } else {
      look.jump_ns = drift_ns;
      Begin(unix_ns);
    }
  }
  looked_ = true;
  last_monotonic_ns_ = monotonic_ns;
  return look;
}

int64_t SeenTime::SeenAt(int64_t unix_ns) const {
  for (auto period = periods_.rbegin(); period != periods_.rend(); ++period) {
    if (unix_ns >= period->begin_unix_ns && unix_ns <= period->end_unix_ns)
      return period->begin_seen_ns + (unix_ns - period->begin_unix_ns);
  }
  if (periods_.empty() || unix_ns > periods_.back().end_unix_ns) return seen_ns_;
  // Nobody saw it: it happened between two periods, and counts from the later one. A clock that was set back
  // in between may have said anything before that.
  for (size_t i = periods_.size(); i-- > 0;) {
    if (unix_ns >= periods_[i].begin_unix_ns) continue;
    const bool is_first = i == 0;
    if (is_first || periods_[i - 1].end_unix_ns <= unix_ns ||
        periods_[i].begin_unix_ns < periods_[i - 1].end_unix_ns)
      return periods_[i].begin_seen_ns;
  }
  return seen_ns_;
}

int64_t SeenTime::Age_ns(int64_t unix_ns) const { return std::max<int64_t>(0, seen_ns_ - SeenAt(unix_ns)); }

}  // namespace weft
