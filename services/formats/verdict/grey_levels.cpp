#include "services/formats/verdict/grey_levels.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/verdict/limits.h"
#include "services/formats/verdict/verdict.h"

namespace weft {

void AddGreyLevelsCheck(v1::Verdict& verdict, const std::vector<PrintContrast>& pictures) {
  const PrintContrast* darkest = nullptr;
  int short_of_good = 0;
  for (const PrintContrast& picture : pictures) {
    if (!(picture.grey_levels > 0)) continue;
    short_of_good += picture.grey_levels < kDecodeGreyLevels.good;
    if (darkest == nullptr || picture.grey_levels < darkest->grey_levels) darkest = &picture;
  }
  if (darkest == nullptr) return;
  std::string reason;
  if (short_of_good > 0) {
    const std::string others =
        short_of_good > 1 ? absl::StrCat(", ", short_of_good - 1, " more below ", kDecodeGreyLevels.good)
                          : "";
    reason = absl::StrFormat("%s is dark or has few bits: its print spans %.0f grey levels%s", darkest->name,
                             darkest->grey_levels, others);
  }
  AddCheck(verdict, kDecodeGreyLevels, darkest->grey_levels, reason);
}

}  // namespace weft
