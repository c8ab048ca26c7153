#include "capture/file/plain_text.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace weft {

size_t Utf8CharacterBytes(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool surrogate = first == 0xED && byte(1) >= 0xA0;
  const bool too_large = first == 0xF4 && byte(1) >= 0x90;
  return overlong || surrogate || too_large ? 0 : length;
}

bool IsControlCharacter(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  const bool c1 = first == 0xC2 && character.size() > 1 && static_cast<unsigned char>(character[1]) < 0xA0;
  return first < 0x20 || first == 0x7F || c1;
}

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const size_t length = Utf8CharacterBytes(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

bool IsPlainText(std::string_view text) {
  while (!text.empty()) {
    const size_t length = Utf8CharacterBytes(text);
    if (length == 0 || IsControlCharacter(text)) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string EscapedText(std::string_view text) {
  std::string plain;
  while (!text.empty()) {
    const size_t length = Utf8CharacterBytes(text);
    const size_t taken = std::max<size_t>(length, 1);
    if (length > 0 && !IsControlCharacter(text)) {
      plain.append(text.substr(0, taken));
    } else {
      for (const char c : text.substr(0, taken))
        absl::StrAppendFormat(&plain, "\\x%02x", static_cast<unsigned char>(c));
    }
    text.remove_prefix(taken);
  }
  return plain;
}

std::string MessageText(std::string_view text, size_t most_bytes) {
  size_t kept = 0;
  while (kept < text.size()) {
    const size_t next = kept + std::max<size_t>(Utf8CharacterBytes(text.substr(kept)), 1);
    if (next > most_bytes) break;
    kept = next;
  }
  const size_t cut = text.size() - kept;
  std::string message;
  for (std::string_view left = text.substr(0, kept); !left.empty();) {
    const size_t line = std::min(left.find('\n'), left.size());
    message += EscapedText(left.substr(0, line));
    if (line < left.size()) message += '\n';
    left.remove_prefix(std::min(line + 1, left.size()));
  }
  if (cut > 0) absl::StrAppend(&message, "... (", cut, " more bytes)");
  return message;
}

}  // namespace weft
