// Content hashes of rigs, boards and templates.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

namespace weft {

// 64-bit FNV-1a over the values added, in order; platform independent. Tells files apart by accident, not by
// malice.
class ContentHash {
 public:
  ContentHash& Add(std::string_view bytes) {
    AddInteger(bytes.size());
    for (const char c : bytes) Byte(static_cast<uint8_t>(c));
    return *this;
  }
  ContentHash& AddInteger(uint64_t value) {
    for (int i = 0; i < 8; ++i) Byte(static_cast<uint8_t>(value >> (8 * i)));
    return *this;
  }
  // -0 and 0 count as the same.
  ContentHash& AddNumber(double value) { return AddInteger(std::bit_cast<uint64_t>(value + 0.0)); }

  // 16 lower-case hex digits.
  std::string Hex() const {
    static constexpr char kDigits[] = "0123456789abcdef";
    std::string out(16, '0');
    for (int i = 0; i < 16; ++i) out[i] = kDigits[(state_ >> (60 - 4 * i)) & 15];
    return out;
  }

 private:
  void Byte(uint8_t b) { state_ = (state_ ^ b) * 0x100000001b3ULL; }

  uint64_t state_ = 0xcbf29ce484222325ULL;
};

}  // namespace weft
