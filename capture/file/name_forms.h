// Forms of names in which those that mean the same are equal.
#pragma once

#include <string>
#include <string_view>

namespace weft {

bool IsDigit(char c);  // 0 to 9

// Composed as Unicode's NFC: macOS stores "é" as "e" with an accent behind it. Text that is no UTF-8 stays.
std::string ComposedName(const std::string& name);

// The same for names that differ in case or composition alone.
std::string CaselessName(const std::string& name);

// The same for names that differ in leading zeros of their numbers alone: "c01" and "c1", "0000" and "0".
// Zeros behind a decimal point stay.
std::string NameWithoutZeros(std::string_view name);

}  // namespace weft
