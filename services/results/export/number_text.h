// Numbers as text that reads back as the same bits.
#pragma once

#include <charconv>
#include <string>

namespace weft {

// The longest that AppendNumber makes of a coordinate: sign, point, nine digits, "e-05" or a leading zero.
inline constexpr size_t kLongestFloat = 15;

// The shortest decimal number that reads back the same.
template <typename Number>
void AppendNumber(std::string& text, Number value) {
  char digits[32];
  const std::to_chars_result end = std::to_chars(digits, digits + sizeof digits, value);
  text.append(digits, end.ptr);
}

}  // namespace weft
