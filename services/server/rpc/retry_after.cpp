#include "services/server/rpc/retry_after.h"

#include <algorithm>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace weft {
namespace {

constexpr absl::string_view kWords = "; retry after ";
constexpr absl::string_view kUnit = " ms";
constexpr std::chrono::minutes kLongest{1};

}  // namespace

absl::Status RetryLater(absl::StatusCode code, const std::string& message, std::chrono::milliseconds delay) {
  return absl::Status(code, absl::StrCat(message, kWords, delay.count(), kUnit));
}

std::optional<std::chrono::milliseconds> RetryAfter(std::string_view message) {
  absl::string_view number(message.data(), message.size());
  const size_t begin = number.rfind(kWords);
  if (begin == absl::string_view::npos || !absl::ConsumeSuffix(&number, kUnit)) return std::nullopt;
  number.remove_prefix(begin + kWords.size());
  int64_t delay_ms = 0;
  if (!absl::SimpleAtoi(number, &delay_ms) || delay_ms < 0) return std::nullopt;
  return std::min<std::chrono::milliseconds>(std::chrono::milliseconds(delay_ms), kLongest);
}

}  // namespace weft
