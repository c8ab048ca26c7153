#include "capture/take/picture_copies.h"

#include <array>

#include "absl/strings/match.h"
#include "capture/file/name_forms.h"

namespace weft {
namespace {

absl::string_view ToAbsl(std::string_view text) { return {text.data(), text.size()}; }

void TrimEnd(std::string_view& text) {
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
}

// Takes " (12)" or "(12)" from the end.
bool TakeNumberInBrackets(std::string_view& name) {
  if (name.empty() || name.back() != ')') return false;
  size_t begin = name.size() - 1;
  while (begin > 0 && IsDigit(name[begin - 1])) --begin;
  if (begin < 2 || begin == name.size() - 1 || name[begin - 1] != '(') return false;
  name = name.substr(0, begin - 1);
  TrimEnd(name);
  return true;
}

// " - Copy", "_copy", " copy": a mark, and a word.
bool TakeWord(std::string_view& name) {
  constexpr std::array kWords = {"copy", "kopie", "copie", "copia"};
  for (const std::string_view word : kWords) {
    if (name.size() < word.size() + 2 || !absl::EndsWithIgnoreCase(ToAbsl(name), ToAbsl(word))) continue;
    std::string_view before = name.substr(0, name.size() - word.size());
    if (before.back() != ' ' && before.back() != '_' && before.back() != '-') continue;
    while (!before.empty() && (before.back() == ' ' || before.back() == '_' || before.back() == '-'))
      before.remove_suffix(1);
    name = before;
    return true;
  }
  return false;
}

}  // namespace

std::string OriginalOfCopy(std::string_view name) {
  constexpr std::string_view kBefore = "copy of ";
  if (absl::StartsWithIgnoreCase(ToAbsl(name), ToAbsl(kBefore)))
    return std::string(name.substr(kBefore.size()));
  std::string_view original = name;
  if (TakeNumberInBrackets(original)) {
    TakeWord(original);
    return std::string(original);
  }
  // "c01 copy 2".
  std::string_view numbered = name;
  while (!numbered.empty() && IsDigit(numbered.back())) numbered.remove_suffix(1);
  if (numbered.size() < name.size()) TrimEnd(numbered);
  if (TakeWord(numbered)) return std::string(numbered);
  return "";
}

std::string NameWithoutFolder(std::string_view name, std::string_view folder) {
  const auto is_mark = [](char c) { return c == '_' || c == '-' || c == '.' || c == ' '; };
  if (folder.empty() || name.size() < folder.size() + 2) return "";
  if (name.starts_with(folder) && is_mark(name[folder.size()]))
    return std::string(name.substr(folder.size() + 1));
  const size_t mark = name.size() - folder.size() - 1;
  return name.ends_with(folder) && is_mark(name[mark]) ? std::string(name.substr(0, mark)) : "";
}

}  // namespace weft
