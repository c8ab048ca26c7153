#include "base/length_unit.h"

#include <array>
#include <utility>

#include "absl/strings/match.h"

namespace weft {
namespace {

constexpr std::array<UnitOfLength, 5> kUnits = {{{"mm", "millimetres", 1},
                                                 {"cm", "centimetres", 10},
                                                 {"m", "metres", 1000},
                                                 {"in", "inches", 25.4},
                                                 {"ft", "feet", 304.8}}};

// Besides names and plurals.
constexpr std::pair<std::string_view, size_t> kOtherNames[] = {
    {"millimetre", 0}, {"millimeter", 0},  {"millimeters", 0}, {"centimetre", 1},
    {"centimeter", 1}, {"centimeters", 1}, {"metre", 2},       {"meter", 2},
    {"meters", 2},     {"inch", 3},        {"\"", 3},          {"foot", 4},
    {"'", 4}};

bool IsSame(std::string_view a, std::string_view b) {
  return absl::EqualsIgnoreCase(absl::string_view(a.data(), a.size()), absl::string_view(b.data(), b.size()));
}

}  // namespace

std::span<const UnitOfLength> UnitsOfLength() { return kUnits; }

std::optional<UnitOfLength> LengthUnitNamed(std::string_view name) {
  for (const UnitOfLength& unit : kUnits)
    if (IsSame(name, unit.name) || IsSame(name, unit.plural)) return unit;
  for (const auto& [other, index] : kOtherNames)
    if (IsSame(name, other)) return kUnits[index];
  return std::nullopt;
}

}  // namespace weft
