#include "services/server/callers/fair_share.h"

#include <algorithm>
#include <chrono>

#include "absl/strings/str_cat.h"
#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

constexpr std::chrono::seconds kRetryWhereFull{5};

absl::Status Full(const std::string& message) {
  return RetryLater(absl::StatusCode::kResourceExhausted, message, kRetryWhereFull);
}

int64_t FreeOf(const ShareLimits& limits, int64_t taken, bool uses_reserve) {
  return std::max<int64_t>(0, limits.all - taken - (uses_reserve ? 0 : limits.reserve));
}

}  // namespace

bool MayTakeMore(const ShareLimits& limits, int64_t taken, int64_t has, int64_t more, bool uses_reserve) {
  const int64_t free = FreeOf(limits, taken, uses_reserve);
  return more <= limits.of_one_caller - has && more <= free && (has == 0 || has + more <= (free - more) / 2);
}

void FairShare::Take(const std::string& caller_name, int64_t amount) {
  by_account_[AccountOf(caller_name)] += amount;
  taken_ += amount;
}

void FairShare::Give(const std::string& caller_name, int64_t amount) {
  const auto found = by_account_.find(AccountOf(caller_name));
  if (found == by_account_.end()) return;
  const int64_t given = std::min(amount, found->second);
  taken_ -= given;
  found->second -= given;
  if (found->second == 0) by_account_.erase(found);
}

int64_t FairShare::TakenBy(const std::string& caller_name) const {
  const auto found = by_account_.find(AccountOf(caller_name));
  return found == by_account_.end() ? 0 : found->second;
}

absl::Status FairShare::Check(const Caller& caller, int64_t amount) const {
  const bool uses_reserve = caller.role >= limits_.reserved_for;
  const int64_t has = TakenBy(caller.name);
  if (MayTakeMore(limits_, taken_, has, amount, uses_reserve)) return absl::OkStatus();
  if (amount > limits_.of_one_caller - has) {
    return Full(
        absl::StrCat(caller.name, " has ", has, " ", what_, ", the most of one caller; end some or wait"));
  }
  if (amount > FreeOf(limits_, taken_, uses_reserve)) {
    return Full(absl::StrCat("all callers together have ", taken_, " of ", limits_.all, " ", what_,
                             uses_reserve || limits_.reserve == 0
                                 ? ""
                                 : absl::StrCat(", and ", limits_.reserve, " are kept for others"),
                             "; end some or wait"));
  }
  return Full(absl::StrCat(caller.name, " has ", has, " ", what_, ", and all callers together ", taken_,
                           " of ", limits_.all, ": the rest is for others; end some or wait"));
}

}  // namespace weft
