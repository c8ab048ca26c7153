// The files of a frame as its report lists them.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "weft/v1/report.pb.h"

namespace weft {

// As v1::ResultFile has it: XXH3 with 64 bits, 16 hex digits.
std::string ListedChecksum(std::string_view bytes);

// Null: the report does not list it.
const v1::ResultFile* FindListed(const v1::FrameReport& report, std::string_view name);

// DataLoss, with `path` and a remedy: the report lists the file with another size or checksum. Reports of
// earlier versions list none.
absl::Status CheckListed(const v1::FrameReport& report, std::string_view name, std::string_view bytes,
                         const std::string& path);

}  // namespace weft
