#include "services/server/retention/retention_policy.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_format.h"
#include "services/server/retention/rehearsal.h"

namespace weft {
namespace {

constexpr double kDay_ns = 24 * 3600e9;

std::vector<SeenTime::Period> PeriodsOf(const v1::RetentionState& state) {
  std::vector<SeenTime::Period> periods;
  for (const v1::RetentionState::Period& period : state.periods())
    periods.push_back({period.begin_unix_ns(), period.end_unix_ns(), period.begin_seen_ns()});
  return periods;
}

bool AreOfTakes(const std::set<v1::HoldingKind>& kinds) { return kinds.contains(v1::HOLDING_KIND_TAKE); }

}  // namespace

RetentionPolicy::RetentionPolicy(const v1::RetentionRules& rules, const v1::RetentionState& earlier)
    : rules_(WithDefaults(rules)),
      seen_(PeriodsOf(earlier)),
      takes_reach_bytes_(earlier.periods().empty() ? -1 : earlier.takes_reach_bytes()) {}

std::string RetentionPolicy::PassTime(int64_t unix_ns, int64_t monotonic_ns) {
  const SeenTime::Look look = seen_.Advance(unix_ns, monotonic_ns);
  if (look.jump_ns == 0) return "";
  due_before_.clear();
  return absl::StrFormat(
      "the clock went %s by %.2f days that nobody saw pass: nothing becomes older by it, and nothing is "
      "removed at this look",
      look.jump_ns > 0 ? "forward" : "back", std::fabs(static_cast<double>(look.jump_ns)) / kDay_ns);
}

void RetentionPolicy::SetRules(const v1::RetentionRules& rules) {
  rules_ = WithDefaults(rules);
  due_before_.clear();
}

double RetentionPolicy::Age_s(const Holding& holding) const {
  int64_t age_ns = seen_.Age_ns(holding.since_unix_ns);
  const auto found = found_seen_ns_.find({holding.kind, holding.id, holding.since_unix_ns});
  if (found != found_seen_ns_.end()) age_ns = std::min(age_ns, seen_.seen_ns() - found->second);
  return static_cast<double>(age_ns) * 1e-9;
}

void RetentionPolicy::NoteNewOnes(const std::set<v1::HoldingKind>& kinds,
                                  const std::vector<Holding>& holdings) {
  std::map<Name, int64_t> found;
  for (const Holding& holding : holdings) {
    const Name name{holding.kind, holding.id, holding.since_unix_ns};
    const auto known = found_seen_ns_.find(name);
    const auto last_look = last_look_seen_ns_.find(holding.kind);
    // At the first look of its kind, its date is all there is.
    if (known != found_seen_ns_.end())
      found.insert(*known);
    else
      found[name] = last_look == last_look_seen_ns_.end() ? INT64_MIN / 2 : last_look->second;
  }
  std::erase_if(found_seen_ns_, [&](const auto& one) { return kinds.contains(std::get<0>(one.first)); });
  found_seen_ns_.merge(found);
  for (const v1::HoldingKind kind : kinds) last_look_seen_ns_[kind] = seen_.seen_ns();
}

RetentionPlan RetentionPolicy::Due(const std::set<v1::HoldingKind>& kinds,
                                   const std::vector<Holding>& holdings, uint64_t free_bytes) {
  NoteNewOnes(kinds, holdings);
  const DiskRoom room{free_bytes, takes_reach_bytes_};
  RetentionPlan plan =
      PlanRetention(rules_, holdings, room, [this](const Holding& holding) { return Age_s(holding); });
  if (AreOfTakes(kinds)) takes_reach_bytes_ = TakesReachAfter(rules_, holdings, room);
  std::set<Name> due;
  std::vector<RetentionStep> confirmed;
  for (RetentionStep& step : plan.steps) {
    const Name name{step.kind, step.id, step.since_unix_ns};
    due.insert(name);
    if (due_before_.contains(name)) confirmed.push_back(std::move(step));
  }
  std::erase_if(due_before_, [&](const Name& name) { return kinds.contains(std::get<0>(name)); });
  due_before_.merge(due);
  plan.steps = std::move(confirmed);
  return plan;
}

RetentionPlan RetentionPolicy::Rehearse(const v1::RetentionRules& rules, const std::vector<Holding>& holdings,
                                        uint64_t free_bytes, double ahead_s) const {
  DiskRoom room{free_bytes, takes_reach_bytes_};
  // For rules that were not in force: as if they came into force now.
  if (rules_.least_free_gib() <= 0)
    room.takes_reach_bytes = TakesReachAfter(rules, holdings, {free_bytes, -1});
  return RehearseRetention(
      rules, holdings, room, [this](const Holding& holding) { return Age_s(holding); }, ahead_s);
}

double RetentionPolicy::seen_days() const { return static_cast<double>(seen_.seen_ns()) / kDay_ns; }

v1::RetentionState RetentionPolicy::State() const {
  v1::RetentionState state;
  for (const SeenTime::Period& period : seen_.periods()) {
    v1::RetentionState::Period& message = *state.add_periods();
    message.set_begin_unix_ns(period.begin_unix_ns);
    message.set_end_unix_ns(period.end_unix_ns);
    message.set_begin_seen_ns(period.begin_seen_ns);
  }
  state.set_takes_reach_bytes(takes_reach_bytes_);
  return state;
}

}  // namespace weft
