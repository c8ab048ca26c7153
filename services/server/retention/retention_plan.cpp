#include "services/server/retention/retention_plan.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "absl/strings/str_format.h"
#include "services/formats/files/enum_words.h"

namespace weft {
namespace {

constexpr double kGib = 1024.0 * 1024 * 1024;
constexpr double kDay_s = 24 * 3600;
constexpr double kHour_s = 3600;

std::string WhyByAge(v1::HoldingKind kind, double days) {
  switch (kind) {
    case v1::HOLDING_KIND_TRASH:
      return absl::StrFormat("it was in the trash for %g days", days);
    case v1::HOLDING_KIND_UPLOAD:
      return absl::StrFormat("nothing came for %g days", days);
    case v1::HOLDING_KIND_NOTICE:
      return absl::StrFormat("nobody took it for %g days", days);
    default:
      return absl::StrFormat("it ended more than %g days ago", days);
  }
}

double BytesOfTakes(const std::vector<Holding>& holdings) {
  double bytes = 0;
  for (const Holding& holding : holdings)
    bytes += IsOfTakes(holding) ? static_cast<double>(holding.bytes) : 0;
  return bytes;
}

RetentionStep StepFor(const Holding& holding, std::string because) {
  RetentionStep step;
  step.kind = holding.kind;
  step.id = holding.id;
  step.since_unix_ns = holding.since_unix_ns;
  step.bytes = holding.bytes;
  step.to_trash = holding.kind == v1::HOLDING_KIND_TAKE;
  step.because = std::move(because);
  return step;
}

// How many bytes of takes must go.
struct Want {
  double bytes = 0;
  std::string because;
};

// What the disk lacks, and how much of it takes took.
struct Lack {
  double bytes = 0, of_takes = 0;
};

Lack LackOfRoom(const v1::RetentionRules& rules, double held_bytes, const DiskRoom& room,
                double freed_bytes) {
  if (rules.least_free_gib() <= 0) return {};
  Lack lack;
  const double least = rules.least_free_gib() * kGib;
  lack.bytes = std::max(0.0, least - static_cast<double>(room.free_bytes) - freed_bytes);
  if (room.takes_reach_bytes < 0) return lack;
  const double beyond = held_bytes + least - static_cast<double>(room.takes_reach_bytes);
  lack.of_takes = std::clamp(beyond, 0.0, lack.bytes);
  return lack;
}

Want WantOfRoom(const v1::RetentionRules& rules, double held_bytes, const Lack& lack) {
  Want want;
  if (rules.takes_quota_gib() > 0) {
    want.bytes = held_bytes - rules.takes_quota_gib() * kGib;
    want.because = absl::StrFormat("takes and trash have more than %g GiB", rules.takes_quota_gib());
  }
  if (lack.of_takes > want.bytes) {
    want.bytes = lack.of_takes;
    want.because = absl::StrFormat("takes left less than %g GiB of the disk free", rules.least_free_gib());
  }
  return want;
}

// The trash by the time of its deletion, then takes by their end.
void SortByTurn(std::vector<const Holding*>& takes) {
  std::ranges::sort(takes, [](const Holding* a, const Holding* b) {
    return std::tuple(a->kind == v1::HOLDING_KIND_TAKE, a->since_unix_ns, a->id) <
           std::tuple(b->kind == v1::HOLDING_KIND_TAKE, b->since_unix_ns, b->id);
  });
}

void AddForRoom(const v1::RetentionRules& rules, std::vector<const Holding*> takes, const Want& want,
                const AgeOf_s& age_s, RetentionPlan& plan) {
  double may_go = 0;
  for (const Holding* take : takes) may_go += take->kept ? 0 : static_cast<double>(take->bytes);
  if (may_go < want.bytes) {
    plan.notes.push_back(absl::StrFormat(
        "%s, but nothing goes: %.2f GiB would have to, and all that is neither pinned nor in use has %.2f",
        want.because, want.bytes / kGib, may_go / kGib));
    return;
  }
  SortByTurn(takes);
  double missing = want.bytes;
  for (const Holding* take : takes) {
    if (missing <= 0) break;
    if (take->kept) continue;
    missing -= static_cast<double>(take->bytes);
    // Young trash, and what goes there now, will make room later.
    if (take->kind == v1::HOLDING_KIND_TAKE || age_s(*take) >= rules.least_trash_hours() * kHour_s)
      plan.steps.push_back(StepFor(*take, want.because));
  }
}

}  // namespace

bool IsOfTakes(const Holding& holding) {
  return holding.kind == v1::HOLDING_KIND_TAKE || holding.kind == v1::HOLDING_KIND_TRASH;
}

v1::RetentionRules DefaultRules() {
  v1::RetentionRules rules;
  rules.set_keep_takes_days(0);
  rules.set_keep_trash_days(7);
  rules.set_keep_jobs_days(0);
  rules.set_takes_quota_gib(0);
  rules.set_least_free_gib(0);
  rules.set_least_trash_hours(1);
  rules.set_keep_uploads_days(7);
  rules.set_keep_notices_days(3);
  return rules;
}

v1::RetentionRules WithDefaults(const v1::RetentionRules& rules) {
  v1::RetentionRules all = DefaultRules();
  all.MergeFrom(rules);
  return all;
}

std::optional<double> KeepDays(const v1::RetentionRules& given, v1::HoldingKind kind) {
  const v1::RetentionRules rules = WithDefaults(given);
  const auto unless_0 = [](double days) { return days > 0 ? std::optional(days) : std::nullopt; };
  switch (kind) {
    case v1::HOLDING_KIND_TAKE:
      return unless_0(rules.keep_takes_days());
    case v1::HOLDING_KIND_JOB:
      return unless_0(rules.keep_jobs_days());
    case v1::HOLDING_KIND_TRASH:
    case v1::HOLDING_KIND_OPERATION:
      return rules.keep_trash_days();
    case v1::HOLDING_KIND_UPLOAD:
      return rules.keep_uploads_days();
    case v1::HOLDING_KIND_NOTICE:
      return rules.keep_notices_days();
    default:
      return std::nullopt;
  }
}

int64_t TakesReachAfter(const v1::RetentionRules& rules, const std::vector<Holding>& holdings,
                        const DiskRoom& room) {
  if (rules.least_free_gib() <= 0) return -1;
  if (room.free_bytes == UINT64_MAX) return room.takes_reach_bytes;  // the disk does not say
  const double held = BytesOfTakes(holdings), least = rules.least_free_gib() * kGib;
  const double free = static_cast<double>(room.free_bytes);
  // Upwards: a part of a byte would be room that takes took, and cost a whole one.
  const auto whole_bytes = [](double bytes) { return static_cast<int64_t>(std::ceil(bytes)); };
  if (free >= least) return whole_bytes(held + free);
  // Who took the room before anybody looked is unknown: not the takes that are there.
  return room.takes_reach_bytes >= 0 ? room.takes_reach_bytes : whole_bytes(held + least);
}

RetentionPlan PlanRetention(const v1::RetentionRules& given, const std::vector<Holding>& holdings,
                            const DiskRoom& room, const AgeOf_s& age_s) {
  const v1::RetentionRules rules = WithDefaults(given);
  RetentionPlan plan;
  std::vector<const Holding*> takes;  // whose age is no reason
  double held_bytes = BytesOfTakes(holdings), freed_bytes = 0;
  for (const Holding& holding : holdings) {
    const std::optional<double> days = KeepDays(rules, holding.kind);
    const bool is_old = days && !holding.kept && age_s(holding) >= *days * kDay_s;
    if (is_old) plan.steps.push_back(StepFor(holding, WhyByAge(holding.kind, *days)));
    if (!IsOfTakes(holding)) continue;
    if (is_old && holding.kind == v1::HOLDING_KIND_TRASH) {
      freed_bytes += static_cast<double>(holding.bytes);
      held_bytes -= static_cast<double>(holding.bytes);
    } else if (!is_old) {
      takes.push_back(&holding);
    }
  }
  const Lack lack = LackOfRoom(rules, held_bytes, room, freed_bytes);
  Want want = WantOfRoom(rules, held_bytes, lack);
  // What goes to the trash by age makes room later, too.
  for (const RetentionStep& step : plan.steps)
    want.bytes -= step.to_trash ? static_cast<double>(step.bytes) : 0;
  if (want.bytes > 0) AddForRoom(rules, std::move(takes), want, age_s, plan);
  if (lack.bytes > lack.of_takes) {
    plan.notes.push_back(absl::StrFormat(
        "the disk has %.2f GiB free, less than %g, and takes did not take the last %.2f: none goes for them",
        static_cast<double>(room.free_bytes) / kGib, rules.least_free_gib(),
        (lack.bytes - lack.of_takes) / kGib));
  }
  return plan;
}

const char* HoldingWords(v1::HoldingKind kind) {
  return kind == v1::HOLDING_KIND_TRASH ? "take in the trash" : EnumWord(kind, "thing");
}

}  // namespace weft
