#include "services/formats/files/text_file.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

using std::string_view_literals::operator""sv;

constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";
// The mark of UTF-32 begins with that of UTF-16.
constexpr std::array<std::string_view, 3> kOtherMarks = {"\xFF\xFE"sv, "\xFE\xFF"sv, "\0\0\xFE\xFF"sv};

}  // namespace

std::string_view WithoutByteOrderMark(std::string_view text) {
  if (text.starts_with(kUtf8Mark)) text.remove_prefix(kUtf8Mark.size());
  return text;
}

absl::Status CheckEncoding(std::string_view text, const std::string& source_name) {
  const bool is_other =
      std::ranges::any_of(kOtherMarks, [text](std::string_view mark) { return text.starts_with(mark); });
  if (!is_other) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(source_name, ": is text in UTF-16 or UTF-32; save it as UTF-8"));
}

absl::StatusOr<std::string> PlainLines(std::string_view bytes, const std::string& source_name) {
  WEFT_RETURN_IF_ERROR(CheckEncoding(bytes, source_name));
  bytes = WithoutByteOrderMark(bytes);
  std::string text;
  text.reserve(bytes.size());
  for (size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] != '\r') {
      text += bytes[i];
    } else if (i + 1 == bytes.size() || bytes[i + 1] != '\n') {
      text += '\n';
    }
  }
  return text;
}

absl::StatusOr<std::string> ReadTextFile(const std::string& path, uint64_t max_bytes) {
  const absl::StatusOr<std::string> bytes = ReadWholeFile(path, max_bytes);
  return bytes.ok() ? PlainLines(*bytes, path) : bytes.status();
}

}  // namespace weft
