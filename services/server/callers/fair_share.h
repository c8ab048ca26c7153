// How much of what all callers share one of them may have.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "services/server/callers/caller.h"

namespace weft {

struct ShareLimits {
  int64_t all = 0;                                              // places, bytes, ...
  int64_t of_one_caller = std::numeric_limits<int64_t>::max();  // at most
  int64_t reserve = 0;                                          // of `all`, for this role and above
  v1::Role reserved_for = v1::ROLE_OPERATOR;
};

// Whether somebody who has so much may have so much more of what is taken already. `uses_reserve`: of a
// caller with the role of the reserve.
bool MayTakeMore(const ShareLimits& limits, int64_t taken, int64_t has, int64_t more, bool uses_reserve);

// Counts by accounts what callers have. Nobody has more than `of_one_caller`, and who has something gets more
// only while that is at most half of what stays free: dynamic thresholds of shared buffers (Choudhury and
// Hahne, IEEE/ACM Transactions on Networking 6(2), 1998). So one caller alone has a third at most, two have a
// quarter each, and there is room for newcomers. Thread safety: none.
class FairShare {
 public:
  // `what` for people: "unfinished jobs".
  FairShare(const ShareLimits& limits, std::string what) : limits_(limits), what_(std::move(what)) {}

  void Take(const std::string& caller_name, int64_t amount = 1);
  void Give(const std::string& caller_name, int64_t amount = 1);

  // Whether the caller may take so much more. ResourceExhausted says who has how much, and when to come
  // again.
  absl::Status Check(const Caller& caller, int64_t amount = 1) const;

  int64_t taken() const { return taken_; }
  int64_t TakenBy(const std::string& caller_name) const;

 private:
  ShareLimits limits_;
  std::string what_;
  int64_t taken_ = 0;
  std::map<std::string, int64_t> by_account_;
};

}  // namespace weft
