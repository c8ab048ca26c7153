// Whether pictures use enough grey levels.
#pragma once

#include <string>
#include <vector>

#include "weft/v1/verdict.pb.h"

namespace weft {

// A camera's pictures, or one picture.
struct PrintContrast {
  std::string name;
  double grey_levels = 0;  // as ViewReport::grey_levels; 0 where no print was seen
};

// Checks the one with the fewest levels, and says how many others fall short. Nothing where no print was
// seen.
void AddGreyLevelsCheck(v1::Verdict& verdict, const std::vector<PrintContrast>& pictures);

}  // namespace weft
