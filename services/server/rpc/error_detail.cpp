#include "services/server/rpc/error_detail.h"

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"

namespace weft {
namespace {

constexpr char kDetailType[] = "type.googleapis.com/weft.v1.ErrorDetail";

}  // namespace

absl::Status FieldError(absl::StatusCode code, const FieldProblem& what) {
  absl::Status status(
      code, absl::StrCat(what.field, ": ", what.problem, what.remedy.empty() ? "" : "; ", what.remedy));
  v1::ErrorDetail detail;
  detail.set_field(EscapedText(what.field));
  detail.set_remedy(EscapedText(what.remedy));
  status.SetPayload(kDetailType, absl::Cord(detail.SerializeAsString()));
  return status;
}

std::optional<v1::ErrorDetail> DetailOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kDetailType);
  v1::ErrorDetail detail;
  if (!payload || !detail.ParseFromString(std::string(*payload))) return std::nullopt;
  return detail;
}

}  // namespace weft
