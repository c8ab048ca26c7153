// Time that a daemon has seen, whatever the clock of the host says.
#pragma once

#include <cstdint>
#include <vector>

namespace weft {

// A clock with a wrong battery or a wrong server makes everything old at once. So ages are counted in time
// that passed while a daemon looked, by the monotonic clock. What happened is dated by the host's clock. The
// periods in which that clock went as a clock does say which time of the daemon this is. Where they leave a
// choice, the younger age counts. Thread safety: none.
class SeenTime {
 public:
  // In all of a period, the host's clock is ahead of seen time by the same.
  struct Period {
    int64_t begin_unix_ns = 0, end_unix_ns = 0;
    int64_t begin_seen_ns = 0;
  };
  // Looks further apart count as one of this length: a process that was stopped has seen nothing.
  static constexpr int64_t kLongestLook_ns = int64_t{10} * 60 * 1'000'000'000;
  // A clock that is corrected by less goes as a clock does.
  static constexpr int64_t kSmallestJump_ns = int64_t{10} * 1'000'000'000;
  static constexpr size_t kMostPeriods = 2000;  // the oldest are forgotten: what is of them becomes younger

  SeenTime() = default;
  // Goes on after earlier periods, in the order in which they were seen.
  explicit SeenTime(std::vector<Period> earlier);

  struct Look {
    bool first = false;   // of this process
    int64_t jump_ns = 0;  // what the host's clock says beyond what was seen; 0: the same
  };
  // Both clocks now. The gap after the earlier periods counts nothing.
  Look Advance(int64_t unix_ns, int64_t monotonic_ns);

  // Over all periods.
  int64_t seen_ns() const { return seen_ns_; }
  // Of what happened at this time of the host's clock: never more than has passed since. What is older than
  // all periods is as old as they are.
  int64_t Age_ns(int64_t unix_ns) const;
  const std::vector<Period>& periods() const { return periods_; }

 private:
  int64_t SeenAt(int64_t unix_ns) const;
  void Begin(int64_t unix_ns);

  std::vector<Period> periods_;
  int64_t seen_ns_ = 0;
  bool looked_ = false;
  int64_t last_monotonic_ns_ = 0;
};

}  // namespace weft
