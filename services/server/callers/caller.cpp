#include "services/server/callers/caller.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace weft {

std::string AccountOf(std::string_view caller_name) {
  constexpr absl::string_view kToken = "token ", kBegin = " (", kEnd = ")";
  absl::string_view rest(caller_name.data(), caller_name.size());
  if (!absl::ConsumePrefix(&rest, kToken) || !absl::ConsumeSuffix(&rest, kEnd))
    return std::string(caller_name);
  const size_t begin = rest.find(kBegin);
  if (begin == absl::string_view::npos) return std::string(caller_name);
  return absl::StrCat(kToken, rest.substr(begin + kBegin.size()));
}

bool IsSameAccount(std::string_view caller_name, std::string_view other_name) {
  return !caller_name.empty() && !other_name.empty() && AccountOf(caller_name) == AccountOf(other_name);
}

}  // namespace weft
