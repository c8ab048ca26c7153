// A verdict from measured values and findings, as text, and as the outcome of a command.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "services/formats/verdict/limits.h"
#include "weft/v1/verdict.pb.h"

namespace weft {

// Grades `value`, in the limit's unit, and adds it to the checks. `reason` is what happened, in words;
// without one the value and its limits are the reason. `remedy` takes the place of the limit's. The verdict
// keeps the worst grade, and the reason and remedy of the first check or finding that had it.
void AddCheck(v1::Verdict& verdict, const Limit& limit, double value, const std::string& reason = "",
              const std::string& remedy = "");

// For what is no number: a camera that is gone, a file that is damaged. Same rule for reason and remedy.
void AddFinding(v1::Verdict& verdict, v1::Grade grade, const std::string& reason, const std::string& remedy);

// "good", "usable", "bad"; "unknown" before anything was added.
std::string GradeWord(v1::Grade grade);

// "good from 99 %, usable from 90 %".
std::string LimitsText(const Limit& limit);

// "usable: REASON" and, where there is one, "  remedy: REMEDY", each a line. Checks that are not good follow,
// a line each, but the one that is the reason.
std::string VerdictText(const v1::Verdict& verdict);

// OK unless the verdict is bad. A bad verdict is an Aborted status that IsVerdict() distinguishes from an
// error. It was printed already at the head of the output, so `weft` prints no error line and exits with
// 1.
absl::Status VerdictStatus(const v1::Verdict& verdict);
bool IsVerdict(const absl::Status& status);

}  // namespace weft
