// What a daemon may remove now.
#pragma once

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "services/server/retention/retention_plan.h"
#include "services/server/retention/seen_time.h"

namespace weft {

// One policy for all that goes by itself. A step is done when it was due at two looks in a row, and the same
// step: a start, a jump of the clock, or new rules give people the time between two looks. Thread safety:
// none.
class RetentionPolicy {
 public:
  RetentionPolicy(const v1::RetentionRules& rules, const v1::RetentionState& earlier);

  // Before each Due, and every second or so: what happens between a jump of the clock and this call may be
  // dated wrong. What happened is worth a line for people; empty: nothing.
  std::string PassTime(int64_t unix_ns, int64_t monotonic_ns);
  // From now on. The next look does nothing.
  void SetRules(const v1::RetentionRules& rules);

  // Looks at all there is of some kinds (takes and their trash go together), and says what to do now.
  // `free_bytes`: of the disk with the takes.
  RetentionPlan Due(const std::set<v1::HoldingKind>& kinds, const std::vector<Holding>& holdings,
                    uint64_t free_bytes);
  // What will be due within `ahead_s`, by other rules. Changes nothing.
  RetentionPlan Rehearse(const v1::RetentionRules& rules, const std::vector<Holding>& holdings,
                         uint64_t free_bytes, double ahead_s) const;

  const v1::RetentionRules& rules() const { return rules_; }
  double seen_days() const;
  // For the next daemon.
  v1::RetentionState State() const;

 private:
  using Name = std::tuple<v1::HoldingKind, std::string, int64_t>;  // kind, id, since
  double Age_s(const Holding& holding) const;
  void NoteNewOnes(const std::set<v1::HoldingKind>& kinds, const std::vector<Holding>& holdings);

  v1::RetentionRules rules_;
  SeenTime seen_;
  int64_t takes_reach_bytes_ = -1;
  std::set<Name> due_before_;
  // Seen time of the look before the first one that found it, for what has come since the first look: its
  // date may be of a clock that was just set.
  std::map<Name, int64_t> found_seen_ns_;
  std::map<v1::HoldingKind, int64_t> last_look_seen_ns_;
};

}  // namespace weft
