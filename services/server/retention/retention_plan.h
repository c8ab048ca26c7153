// What is due to be removed by the rules.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "weft/v1/retention.pb.h"

namespace weft {

inline constexpr double kMostRule = 1e9;  // rules are numbers from 0 to this

// What a daemon does unless it is told otherwise: all fields are set.
v1::RetentionRules DefaultRules();
// DefaultRules with what is set of `rules`. A field that is not set is no 0: that would empty the trash.
v1::RetentionRules WithDefaults(const v1::RetentionRules& rules);

// Fields of rules that are not set are as in DefaultRules, here and below.
// For how long things of a kind are kept. None: at any age.
std::optional<double> KeepDays(const v1::RetentionRules& rules, v1::HoldingKind kind);

// Something that a rule may remove.
struct Holding {
  v1::HoldingKind kind = v1::HOLDING_KIND_UNSPECIFIED;
  std::string id;
  int64_t since_unix_ns = 0;  // it ended, was deleted, or came to rest otherwise
  uint64_t bytes = 0;
  bool kept = false;  // pinned, being recorded, or read by somebody
};

// A take, or one in the trash.
bool IsOfTakes(const Holding& holding);

// The disk with the takes.
struct DiskRoom {
  uint64_t free_bytes = UINT64_MAX;
  // What takes, trash and free room had together when `least_free_gib` was last kept: what others wrote since
  // costs no take. Negative: unknown.
  int64_t takes_reach_bytes = -1;
};

// DiskRoom.takes_reach_bytes after a look; as it was while the disk has less room than the rule says.
int64_t TakesReachAfter(const v1::RetentionRules& rules, const std::vector<Holding>& holdings,
                        const DiskRoom& room);

struct RetentionStep {
  v1::HoldingKind kind = v1::HOLDING_KIND_UNSPECIFIED;
  std::string id;
  int64_t since_unix_ns = 0;
  uint64_t bytes = 0;
  bool to_trash = false;
  std::string because;
  double due_in_s = 0;  // of a rehearsal
};

// Seconds since Holding.since_unix_ns, as far as they were seen.
using AgeOf_s = std::function<double(const Holding& holding)>;

struct RetentionPlan {
  std::vector<RetentionStep> steps;
  std::vector<std::string> notes;  // what will not be done, and why
};

// What is due now, in order. By age, each kind by its rule. For want of room (a quota, or a disk that has
// less free than it should) takes alone: the trash goes first, by the time of the deletion, then the oldest
// takes go into it. No more goes than is needed; nothing goes where all that may go would not do. `age_s` is
// asked for elements of `holdings`.
RetentionPlan PlanRetention(const v1::RetentionRules& rules, const std::vector<Holding>& holdings,
                            const DiskRoom& room, const AgeOf_s& age_s);

// "take", "take in the trash", "job", ...
const char* HoldingWords(v1::HoldingKind kind);

}  // namespace weft
