#include "base/nearest_word.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr size_t kLeastBeginning = 3;  // letters that tell a name by its beginning

bool Begins(std::string_view name, std::string_view word) {
  return word.size() >= kLeastBeginning && (name.starts_with(word) || word.starts_with(name));
}

}  // namespace

size_t EditDistance(std::string_view a, std::string_view b) {
  // Of the last two letters of `a` and that before them; names are short.
  std::vector<size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    before.swap(above);
    above.swap(row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({above[j - 1] + (a[i - 1] != b[j - 1]), above[j] + 1, row[j - 1] + 1});
      const bool is_exchanged = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (is_exchanged) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

std::string NearestWord(std::string_view word, std::span<const std::string> names) {
  std::string nearest;
  size_t least = std::numeric_limits<size_t>::max();
  for (const std::string& name : names) {
    const size_t most = std::max<size_t>(1, std::max(word.size(), name.size()) / 3);
    const size_t distance = EditDistance(word, name);
    if (distance >= least || (distance > most && !Begins(name, word))) continue;
    least = distance;
    nearest = name;
  }
  return nearest;
}

std::string DidYouMean(std::string_view word, std::span<const std::string> names) {
  const std::string nearest = NearestWord(word, names);
  return nearest.empty() ? "" : absl::StrCat("; did you mean ", nearest, "?");
}

}  // namespace weft
