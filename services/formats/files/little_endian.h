// Numbers as bytes, little-endian whatever the machine.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

namespace weft {

template <typename Number>
using BitsOf =
    std::conditional_t<sizeof(Number) == 8, uint64_t,
                       std::conditional_t<sizeof(Number) == 4, uint32_t,
                                          std::conditional_t<sizeof(Number) == 2, uint16_t, uint8_t>>>;

template <typename Number>
void PutLittleEndian(Number value, std::string& out) {
  const auto bits = std::bit_cast<BitsOf<Number>>(value);
  for (size_t i = 0; i < sizeof(Number); ++i) out += static_cast<char>(bits >> (8 * i) & 0xff);
}

// Takes a number off the front, which must be long enough.
template <typename Number>
Number TakeLittleEndian(std::string_view& bytes) {
  BitsOf<Number> bits = 0;
  for (size_t i = 0; i < sizeof(Number); ++i)
    bits = static_cast<BitsOf<Number>>(
        bits |
        static_cast<BitsOf<Number>>(static_cast<BitsOf<Number>>(static_cast<uint8_t>(bytes[i])) << (8 * i)));
  bytes.remove_prefix(sizeof(Number));
  return std::bit_cast<Number>(bits);
}

}  // namespace weft
