#include "services/server/callers/owners.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "services/server/rpc/error_detail.h"

namespace weft {

absl::Status CheckMayChange(const Caller& caller, const std::string& field, const std::string& what,
                            const std::string& owner) {
  if (IsOperator(caller) || IsSameAccount(caller.name, owner)) return absl::OkStatus();
  if (owner.empty()) {
    return FieldError(absl::StatusCode::kPermissionDenied,
                      {field, absl::StrCat("nobody knows whose ", what, " is"), "ask an operator"});
  }
  return FieldError(absl::StatusCode::kPermissionDenied,
                    {field, absl::StrCat(what, " belongs to ", owner), "ask its owner or an operator"});
}

absl::Status CheckRepeats(const Caller& caller, const std::string& owner, bool asks_for_the_same,
                          const std::string& what) {
  const bool is_theirs = IsSameAccount(owner, caller.name);
  if (is_theirs && asks_for_the_same) return absl::OkStatus();
  return FieldError(absl::StatusCode::kAlreadyExists,
                    {"idempotency_key",
                     is_theirs ? what + " with another request" : "stands for a request of somebody else",
                     "choose a new key"});
}

int PriorityFor(const Caller& caller, int asked) {
  return IsOperator(caller) ? asked : std::min(asked, kMostPriorityOfClients);
}

int PriorityClass(int priority) {
  return priority >= -kMostPriorityOfClients && priority <= kMostPriorityOfClients ? 0 : priority;
}

}  // namespace weft
