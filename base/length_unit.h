// Units of length, as options name them.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace weft {

struct UnitOfLength {
  const char* name;    // "m"
  const char* plural;  // "metres"
  double mm;
};

std::span<const UnitOfLength> UnitsOfLength();  // mm, cm, m, in, ft

// By its name, or as people write it, in any case: "inch", "Inches", "metre", "meters", "foot".
std::optional<UnitOfLength> LengthUnitNamed(std::string_view name);

}  // namespace weft
