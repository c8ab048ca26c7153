// What the rules will remove in the days to come.
#pragma once

#include <vector>

#include "services/server/retention/retention_plan.h"

namespace weft {

// The steps within `ahead_s`, in the order of their time, `due_in_s`, if nothing is added and each is done
// when it is due: a take that goes to the trash is removed for good after its time there, and what is gone
// makes room. Arguments and notes as those of PlanRetention.
RetentionPlan RehearseRetention(const v1::RetentionRules& rules, std::vector<Holding> holdings, DiskRoom room,
                                const AgeOf_s& age_s, double ahead_s);

}  // namespace weft
