#include "services/server/retention/rehearsal.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

namespace weft {
namespace {

constexpr double kDueDay_s = 24 * 3600, kDueHour_s = 3600;
// Ages are differences of large numbers.
constexpr double kTick_s = 1e-3;

// Of takes and trash: one makes room for another.
class Rehearsal {
 public:
  Rehearsal(const v1::RetentionRules& rules, std::vector<Holding> holdings, const DiskRoom& room,
            const AgeOf_s& age_s)
      : rules_(rules), holdings_(std::move(holdings)), room_(room) {
    for (const Holding& holding : holdings_) begun_s_.push_back(-age_s(holding));
  }

  RetentionPlan Run(double ahead_s) {
    RetentionPlan all;
    for (double now_s = 0; now_s <= ahead_s; now_s = NextDue_s(now_s)) {
      // What was just moved may be due at once.
      for (bool goes_on = true; goes_on;) {
        RetentionPlan plan = PlanRetention(rules_, holdings_, room_, [this, now_s](const Holding& holding) {
          return now_s - begun_s_[static_cast<size_t>(&holding - holdings_.data())] + kTick_s;
        });
        for (std::string& note : plan.notes)
          if (std::ranges::find(all.notes, note) == all.notes.end()) all.notes.push_back(std::move(note));
        for (RetentionStep& step : plan.steps) {
          step.due_in_s = now_s;
          Do(step, now_s);
          all.steps.push_back(std::move(step));
        }
        goes_on = !plan.steps.empty();
      }
    }
    return all;
  }

 private:
  void Do(const RetentionStep& step, double now_s) {
    const auto at = std::ranges::find_if(holdings_, [&step](const Holding& holding) {
      return holding.kind == step.kind && holding.id == step.id;
    });
    const auto begun = begun_s_.begin() + (at - holdings_.begin());
    if (step.to_trash) {
      at->kind = v1::HOLDING_KIND_TRASH;
      at->since_unix_ns = step.since_unix_ns + std::llround(1e9 * (now_s - *begun));
      *begun = now_s;
      return;
    }
    if (room_.free_bytes != UINT64_MAX) room_.free_bytes += step.bytes;
    holdings_.erase(at);
    begun_s_.erase(begun);
  }

  // The next moment after `now_s` at which something reaches an age of the rules.
  double NextDue_s(double now_s) const {
    double next_s = std::numeric_limits<double>::infinity();
    const auto note = [&](double due_s) {
      if (due_s > now_s + kTick_s) next_s = std::min(next_s, due_s);
    };
    for (size_t i = 0; i < holdings_.size(); ++i) {
      if (holdings_[i].kept) continue;
      if (const std::optional<double> days = KeepDays(rules_, holdings_[i].kind))
        note(begun_s_[i] + *days * kDueDay_s);
      if (holdings_[i].kind == v1::HOLDING_KIND_TRASH)
        note(begun_s_[i] + rules_.least_trash_hours() * kDueHour_s);
    }
    return next_s;
  }

  const v1::RetentionRules& rules_;
  std::vector<Holding> holdings_;
  std::vector<double> begun_s_;  // of each holding's age, from now on
  DiskRoom room_;
};

}  // namespace

RetentionPlan RehearseRetention(const v1::RetentionRules& given, std::vector<Holding> holdings, DiskRoom room,
                                const AgeOf_s& age_s, double ahead_s) {
  const v1::RetentionRules rules = WithDefaults(given);
  const auto others = std::stable_partition(holdings.begin(), holdings.end(), IsOfTakes);
  // Of all else each goes by its own age.
  std::vector<RetentionStep> steps;
  for (auto other = others; other != holdings.end(); ++other) {
    const double age = age_s(*other);
    for (RetentionStep& step :
         PlanRetention(rules, {*other}, {}, [&](const Holding&) { return age + ahead_s; }).steps) {
      step.due_in_s = std::max(0.0, *KeepDays(rules, other->kind) * kDueDay_s - age);
      steps.push_back(std::move(step));
    }
  }
  holdings.erase(others, holdings.end());
  RetentionPlan plan = Rehearsal(rules, std::move(holdings), room, age_s).Run(ahead_s);
  std::ranges::move(steps, std::back_inserter(plan.steps));
  std::ranges::stable_sort(plan.steps, {}, &RetentionStep::due_in_s);
  return plan;
}

}  // namespace weft
