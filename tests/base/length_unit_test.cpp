#include "base/length_unit.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(UnitOfLength, IsFoundAsPeopleWriteIt) {
  const struct {
    double mm;
    std::initializer_list<const char*> names;
  } kUnits[] = {{1, {"mm", "MM", "millimetres", "millimeter"}},
                {10, {"cm", "centimetre", "Centimeters"}},
                {1000, {"m", "metre", "meters"}},
                {25.4, {"in", "inch", "Inches", "\""}},
                {304.8, {"ft", "foot", "feet", "'"}}};
  for (const auto& [mm, names] : kUnits)
    for (const char* name : names) {
      ASSERT_TRUE(LengthUnitNamed(name)) << name;
      EXPECT_EQ(LengthUnitNamed(name)->mm, mm) << name;
    }
  for (const char* name : {"", "km", "inc", "m "}) EXPECT_FALSE(LengthUnitNamed(name)) << name;
}

}  // namespace
}  // namespace weft
