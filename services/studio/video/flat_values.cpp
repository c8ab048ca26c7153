#include "services/studio/video/flat_values.h"

#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

constexpr size_t kMostLine = 1000;

std::string Unquoted(absl::string_view value) {
  if (value.size() < 2 || value.front() != '"' || value.back() != '"') return std::string(value);
  std::string text;
  for (size_t i = 1; i + 1 < value.size(); ++i) {
    if (value[i] == '\\' && i + 2 < value.size()) ++i;
    text += value[i];
  }
  return text;
}

}  // namespace

FlatValues ValuesOf(std::string_view flat) {
  FlatValues values;
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(flat.data(), flat.size()), '\n', absl::SkipEmpty())) {
    const size_t equals = line.find('=');
    if (equals == absl::string_view::npos || line.size() > kMostLine) continue;
    // Names of tags differ in their case between containers.
    values.emplace(absl::AsciiStrToLower(line.substr(0, equals)), Unquoted(line.substr(equals + 1)));
  }
  return values;
}

std::string ValueOf(const FlatValues& values, const std::string& name) {
  const auto found = values.find(name);
  return found == values.end() || found->second == "N/A" ? "" : found->second;
}

std::optional<std::pair<int64_t, int64_t>> FractionOf(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, '/');
  int64_t num = 0, den = 0;
  if (parts.size() != 2 || !absl::SimpleAtoi(parts[0], &num) || !absl::SimpleAtoi(parts[1], &den))
    return std::nullopt;
  if (num <= 0 || den <= 0 || num > INT32_MAX || den > INT32_MAX) return std::nullopt;
  return std::pair(num, den);
}

int IntegerOf(const FlatValues& values, const std::string& name) {
  int number = 0;
  return absl::SimpleAtoi(ValueOf(values, name), &number) ? number : 0;
}

}  // namespace weft
