#include "services/server/access/call_limits.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/server/callers/fair_share.h"
#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

using std::chrono::milliseconds;

constexpr std::chrono::seconds kBeginsWithin{10};
constexpr std::chrono::minutes kForgetEvery{1};

const char* WordOf(CallKind kind) {
  return kind == CallKind::kUnary ? "calls" : kind == CallKind::kStream ? "streams" : "uploads";
}

std::optional<ShareLimits> LimitsOfAll(const CallerLimits& limits, CallKind kind) {
  if (kind == CallKind::kUpload) return std::nullopt;
  const bool is_unary = kind == CallKind::kUnary;
  return ShareLimits{.all = is_unary ? limits.all_unary : limits.all_streams,
                     .of_one_caller = limits.Of(kind),
                     .reserve = is_unary ? limits.reserved_unary : limits.reserved_streams};
}

// Streams and uploads last longer than questions.
milliseconds RetryWhereFull(CallKind kind) {
  return kind == CallKind::kUnary ? milliseconds(100) : milliseconds(1000);
}

}  // namespace

CallLimits::CallLimits(CallerLimits limits, Clock clock)
    : limits_(limits), clock_(std::move(clock)), forgot_(clock_()) {}

CallLimits::Account& CallLimits::AccountOf(const std::string& caller, Time now) {
  const auto [account, is_new] = accounts_.try_emplace(caller);
  Account& found = account->second;
  if (is_new) found.tokens = limits_.burst;
  const double passed_s = std::chrono::duration<double>(now - found.filled).count();
  if (!is_new) found.tokens = std::min(limits_.burst, found.tokens + limits_.calls_per_s * passed_s);
  found.filled = now;
  return found;
}

absl::Status CallLimits::Charge(const std::string& caller, Account& account) const {
  if (account.tokens < 1) {
    const double wait_ms = 1000 * (1 - account.tokens) / limits_.calls_per_s;
    return RetryLater(absl::StatusCode::kResourceExhausted,
                      absl::StrCat(caller, " makes more than ", limits_.calls_per_s, " calls per second"),
                      milliseconds(static_cast<int64_t>(std::ceil(wait_ms))));
  }
  account.tokens -= 1;
  return absl::OkStatus();
}

absl::Status CallLimits::Charge(const std::string& caller) {
  const MutexLock lock(mutex_);
  const Time now = clock_();
  Forget(now);
  return Charge(caller, AccountOf(caller, now));
}

absl::Status CallLimits::Admit(const std::string& caller, CallKind kind, v1::Role role) {
  const MutexLock lock(mutex_);
  const Time now = clock_();
  Forget(now);
  Account& account = AccountOf(caller, now);
  WEFT_RETURN_IF_ERROR(Charge(caller, account));
  Calls& calls = account.calls.at(static_cast<size_t>(kind));
  while (!calls.admitted.empty() && now - calls.admitted.front() > kBeginsWithin) calls.admitted.pop_front();
  const int open = calls.running + static_cast<int>(calls.admitted.size());
  if (open >= limits_.Of(kind)) {
    return RetryLater(absl::StatusCode::kResourceExhausted,
                      absl::StrCat(caller, " has ", open, " ", WordOf(kind), " open, the most at once"),
                      RetryWhereFull(kind));
  }
  const std::optional<ShareLimits> all = LimitsOfAll(limits_, kind);
  const int taken = OpenOf(kind, now);
  if (all && !MayTakeMore(*all, taken, open, 1, role >= all->reserved_for)) {
    return RetryLater(
        absl::StatusCode::kResourceExhausted,
        absl::StrCat(caller, " has ", open, " ", WordOf(kind), " open, and all callers together ", taken,
                     " of ", all->all, ": the rest is for ",
                     taken < all->all - all->reserve ? "others" : "operators"),
        RetryWhereFull(kind));
  }
  calls.admitted.push_back(now);
  return absl::OkStatus();
}

int CallLimits::OpenOf(CallKind kind, Time now) const {
  size_t open = 0;
  for (const auto& [name, account] : accounts_) {
    const Calls& calls = account.calls.at(static_cast<size_t>(kind));
    const auto is_late = [now](Time admitted) { return now - admitted > kBeginsWithin; };
    open += static_cast<size_t>(calls.running) + calls.admitted.size() -
            static_cast<size_t>(std::ranges::count_if(calls.admitted, is_late));
  }
  return static_cast<int>(open);
}

void CallLimits::Begin(const std::string& caller, CallKind kind) {
  const MutexLock lock(mutex_);
  Calls& calls = AccountOf(caller, clock_()).calls.at(static_cast<size_t>(kind));
  if (!calls.admitted.empty()) calls.admitted.pop_front();
  ++calls.running;
  ++running_.at(static_cast<size_t>(kind));
}

void CallLimits::End(const std::string& caller, CallKind kind) {
  const MutexLock lock(mutex_);
  --AccountOf(caller, clock_()).calls.at(static_cast<size_t>(kind)).running;
  --running_.at(static_cast<size_t>(kind));
}

int CallLimits::Running(CallKind kind) {
  const MutexLock lock(mutex_);
  return running_.at(static_cast<size_t>(kind));
}

// Callers who have nothing open and a full account are as good as new ones.
void CallLimits::Forget(Time now) {
  if (now - forgot_ < kForgetEvery) return;
  forgot_ = now;
  std::erase_if(accounts_, [&](const auto& entry) {
    const Account& account = entry.second;
    const double passed_s = std::chrono::duration<double>(now - account.filled).count();
    return passed_s * limits_.calls_per_s >= limits_.burst &&
           std::ranges::all_of(account.calls, [](const Calls& calls) { return calls.running == 0; });
  });
}

}  // namespace weft
