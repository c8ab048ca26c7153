// Names and messages that any file, terminal and page can hold.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace weft {

// Bytes of the UTF-8 character at the front of a text that is not empty; 0 where there is none (RFC 3629).
size_t Utf8CharacterBytes(std::string_view text);

// True for a control character (C0, delete, C1) at the front, which may steer a terminal.
bool IsControlCharacter(std::string_view character);

// Is it UTF-8?
bool IsUtf8(std::string_view text);
// Is it UTF-8 without control characters?
bool IsPlainText(std::string_view text);

// Text that is not plain becomes so: each byte that is no UTF-8, or of a control character, as \xNN.
// Newline and tab are control characters too. Plain text stays as it is.
std::string EscapedText(std::string_view text);

// For terminals and logs, whatever a message quotes: escaped, but its lines stay lines. What goes beyond
// `most_bytes` is cut, and the text says how much that was.
std::string MessageText(std::string_view text, size_t most_bytes = 2000);

}  // namespace weft
