#include "base/natural_order.h"

#include "absl/strings/ascii.h"

namespace weft {
namespace {

// Where digits that end before `at` are followed by a point: digits behind it are a fraction. Shorter ones
// count as versions do, where 1.9 is before 1.10.
bool BeginsFractionOfTime(std::string_view text, size_t at) {
  if (at == 0 || text[at - 1] != '.') return false;
  size_t begin = at - 1;
  while (begin > 0 && absl::ascii_isdigit(text[begin - 1])) --begin;
  return at - 1 - begin >= kDigitsOfTime;
}

}  // namespace

bool NaturalLess(std::string_view a, std::string_view b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (absl::ascii_isdigit(a[i]) && absl::ascii_isdigit(b[j])) {
      size_t ie = i, je = j;
      while (ie < a.size() && absl::ascii_isdigit(a[ie])) ++ie;
      while (je < b.size() && absl::ascii_isdigit(b[je])) ++je;
      if (BeginsFractionOfTime(a, i) && BeginsFractionOfTime(b, j)) {
        // As decimals: of equal beginnings the shorter one is less.
        const int order = a.substr(i, ie - i).compare(b.substr(j, je - j));
        if (order != 0) return order < 0;
        i = ie;
        j = je;
        continue;
      }
      while (i + 1 < ie && a[i] == '0') ++i;
      while (j + 1 < je && b[j] == '0') ++j;
      if (ie - i != je - j) return ie - i < je - j;
      const int order = a.substr(i, ie - i).compare(b.substr(j, je - j));
      if (order != 0) return order < 0;
      i = ie;
      j = je;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

}  // namespace weft
