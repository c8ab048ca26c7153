// Who may change what somebody started.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "services/server/callers/caller.h"

namespace weft {

// Runs the studio, and may therefore change what others started.
inline bool IsOperator(const Caller& caller) { return caller.role >= v1::ROLE_OPERATOR; }

// Whether the caller may cancel, delete, overwrite or move `what` ("job 20260101-..."), which `field` of the
// request names: its owner may, and operators. `owner` is a caller's name; empty: nobody knows, and operators
// alone may. PermissionDenied says whose it is, and what to do.
absl::Status CheckMayChange(const Caller& caller, const std::string& field, const std::string& what,
                            const std::string& owner);

// Whether a request may have the answer of the first one with its idempotency key, which `owner` gave; `what`
// that one made ("job 20260101-... was submitted"). AlreadyExists: it is somebody else's, without a word
// about theirs, or it asked for something else.
absl::Status CheckRepeats(const Caller& caller, const std::string& owner, bool asks_for_the_same,
                          const std::string& what);

// Priorities up to this one, and down to its negative, put the jobs of each caller into their order, and
// callers take turns whatever theirs are. Higher ones go before all others and are for operators, since a
// client that chooses them would always be first; lower ones go after all others.
constexpr int kMostPriorityOfClients = 10;

// The priority that a job of this caller gets.
int PriorityFor(const Caller& caller, int asked);

// Among whom callers take turns: jobs of the same class. Higher ones go first.
int PriorityClass(int priority);

}  // namespace weft
