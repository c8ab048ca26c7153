// Text and numbers as reports show them.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace weft {

// Safe as text and inside quoted attributes. Bytes that are no UTF-8 and control characters become U+FFFD.
std::string EscapeHtml(std::string_view text);
// A name from outside: escaped, and isolated so that right-to-left characters stay its own affair.
std::string NameHtml(std::string_view name);
// At most `characters` of the text, with an ellipsis where it was cut; not escaped.
std::string Shortened(std::string_view text, size_t characters);
// "too_few_views" as "too few views"; not escaped.
std::string Words(std::string_view identifier);

// A number that is not there.
inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

// Numbers that are not finite come out as a dash.
std::string FormatCount(int64_t count);                // "12,345"
std::string FormatNumber(double value, int decimals);  // "0.14", "1,204.5"
std::string FormatPercent(double share);               // 0.952: "95.2 %"
// "1 frame", "12 frames".
std::string Counted(int64_t count, const std::string& singular, const std::string& plural);

std::string Base64(std::string_view bytes);

}  // namespace weft
