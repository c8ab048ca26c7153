// What ffprobe prints with "-of flat": a line for each value.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace weft {

// Of streams.stream.0.tags.timecode="10:22:33:12": the name in small letters, and the text without quotes.
using FlatValues = std::map<std::string, std::string, std::less<>>;

// Lines that are too long for what is asked of ffprobe, and such without a value, are left out.
FlatValues ValuesOf(std::string_view flat);
// Empty where it is missing or "N/A".
std::string ValueOf(const FlatValues& values, const std::string& name);
// "30000/1001"; nothing where a part is no positive number of 31 bits.
std::optional<std::pair<int64_t, int64_t>> FractionOf(const std::string& text);
// 0 where it is no number.
int IntegerOf(const FlatValues& values, const std::string& name);

}  // namespace weft
