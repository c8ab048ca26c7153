#include "services/daemon/take_retention.h"

#include <algorithm>
#include <map>

#include "absl/strings/str_format.h"

namespace weft {
namespace {

constexpr double kGib = 1024.0 * 1024 * 1024;
constexpr double kDay_ns = 24 * 3600e9;

// What must go until both limits are kept.
double BytesTooMany(const RetentionRules& rules, const std::vector<KeptTake>& takes, double free_bytes) {
  double held = 0;
  for (const KeptTake& take : takes) held += static_cast<double>(take.bytes);
  double too_many = 0;
  if (rules.takes_quota_gib > 0) too_many = held - rules.takes_quota_gib * kGib;
  if (rules.least_free_gib > 0) too_many = std::max(too_many, rules.least_free_gib * kGib - free_bytes);
  return too_many;
}

}  // namespace

std::vector<RetentionStep> PlanRetention(const RetentionRules& rules, std::vector<KeptTake> takes,
                                         uint64_t free_bytes, int64_t now_ns) {
  std::vector<RetentionStep> steps;
  std::map<std::string, bool> removed;
  const auto older_than = [&](int64_t time_ns, double days) {
    return static_cast<double>(now_ns - time_ns) > days * kDay_ns;
  };
  const auto remove = [&](const KeptTake& take, const std::string& because) {
    steps.push_back({take.id, true, because});
    removed[take.id] = true;
  };
  for (KeptTake& take : takes) {
    if (take.deleted_unix_ns != 0) {
      if (older_than(take.deleted_unix_ns, rules.keep_trash_days)) {
        remove(take, absl::StrFormat("it was in the trash for %g days", rules.keep_trash_days));
      }
    } else if (!take.kept && rules.keep_takes_days > 0 &&
               older_than(take.ended_unix_ns, rules.keep_takes_days)) {
      steps.push_back({take.id, false, absl::StrFormat("it is older than %g days", rules.keep_takes_days)});
      take.deleted_unix_ns = now_ns;
    }
  }
  double free_now = static_cast<double>(free_bytes);
  for (const KeptTake& take : takes)
    free_now += removed.contains(take.id) ? static_cast<double>(take.bytes) : 0;
  std::erase_if(takes, [&](const KeptTake& take) { return removed.contains(take.id); });
  // The trash, by the time of its deletion; then takes by their end.
  std::sort(takes.begin(), takes.end(), [](const KeptTake& a, const KeptTake& b) {
    const bool a_deleted = a.deleted_unix_ns != 0, b_deleted = b.deleted_unix_ns != 0;
    if (a_deleted != b_deleted) return a_deleted;
    const int64_t a_time = a_deleted ? a.deleted_unix_ns : a.ended_unix_ns;
    const int64_t b_time = b_deleted ? b.deleted_unix_ns : b.ended_unix_ns;
    return a_time != b_time ? a_time < b_time : a.id < b.id;
  });
  double too_many = BytesTooMany(rules, takes, free_now);
  for (const KeptTake& take : takes) {
    if (too_many <= 0) break;
    if (take.deleted_unix_ns == 0) {
      if (take.kept) continue;
      steps.push_back({take.id, false, "takes need more room than the limits allow"});
    }
    remove(take, "takes need more room than the limits allow");
    too_many -= static_cast<double>(take.bytes);
  }
  return steps;
}

}  // namespace weft
