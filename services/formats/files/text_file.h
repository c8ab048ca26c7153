// Text as editors and other programs save it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// The text behind the byte order mark of UTF-8, which editors on Windows put in front; as it is where there
// is none.
std::string_view WithoutByteOrderMark(std::string_view text);

// InvalidArgument names `source_name` where the text begins with a mark of UTF-16 or UTF-32.
absl::Status CheckEncoding(std::string_view text, const std::string& source_name);

// UTF-8 text without a byte order mark, every line ending with \n. Errors of CheckEncoding.
absl::StatusOr<std::string> PlainLines(std::string_view bytes, const std::string& source_name);

// PlainLines of a file. Errors of ReadWholeFile besides.
absl::StatusOr<std::string> ReadTextFile(const std::string& path, uint64_t max_bytes = uint64_t{4} << 30);

}  // namespace weft
