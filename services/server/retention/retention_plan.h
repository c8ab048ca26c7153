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

struct RetentionRules {
  double keep_takes_days = 0;    // older ones go to the trash; 0: any age is kept
  double keep_trash_days = 7;    // then they are removed for good; operations, too
  double keep_jobs_days = 0;     // ended ones are forgotten, with results in the state folder; 0: never
  double takes_quota_gib = 0;    // takes and trash together; 0: no limit
  double least_free_gib = 0;     // of the disk; 0: nothing goes for its sake
  double least_trash_hours = 1;  // what is in the trash for less does not go for want of room
  double keep_uploads_days = 7;  // since their last piece
  double keep_notices_days = 3;
};

// For how long things of a kind are kept. None: at any age.
std::optional<double> KeepDays(const RetentionRules& rules, v1::HoldingKind kind);

v1::RetentionRules InMessage(const RetentionRules& rules);
// What the message does not give is as in `otherwise`.
RetentionRules FromMessage(const v1::RetentionRules& message, RetentionRules otherwise);

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
int64_t TakesReachAfter(const RetentionRules& rules, const std::vector<Holding>& holdings,
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
RetentionPlan PlanRetention(const RetentionRules& rules, const std::vector<Holding>& holdings,
                            const DiskRoom& room, const AgeOf_s& age_s);

// "take", "take in the trash", "job", ...
const char* HoldingWords(v1::HoldingKind kind);

}  // namespace weft
