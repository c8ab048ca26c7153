#include "base/error_reason.h"

#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr char kPayload[] = "weft/error-reason";

}  // namespace

absl::Status WithReason(absl::Status status, ErrorReason reason) {
  if (!status.ok()) status.SetPayload(kPayload, absl::Cord(absl::StrCat(static_cast<int>(reason))));
  return status;
}

ErrorReason ReasonOf(const absl::Status& status) {
  const absl::optional<absl::Cord> text = status.GetPayload(kPayload);
  int reason = 0;
  return text && absl::SimpleAtoi(std::string(*text), &reason) ? static_cast<ErrorReason>(reason)
                                                               : ErrorReason::kNone;
}

absl::Status WithMessage(const absl::Status& status, const std::string& message) {
  absl::Status rewritten(status.code(), message);
  status.ForEachPayload(
      [&rewritten](absl::string_view url, const absl::Cord& payload) { rewritten.SetPayload(url, payload); });
  return rewritten;
}

}  // namespace weft
