#include "services/formats/files/listed_file.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/file/checksum.h"

namespace weft {

std::string ListedChecksum(std::string_view bytes) {
  return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
}

const v1::ResultFile* FindListed(const v1::FrameReport& report, std::string_view name) {
  for (const v1::ResultFile& file : report.files())
    if (file.name() == name) return &file;
  return nullptr;
}

absl::Status CheckListed(const v1::FrameReport& report, std::string_view name, std::string_view bytes,
                         const std::string& path) {
  const v1::ResultFile* listed = FindListed(report, name);
  if (listed == nullptr ||
      (listed->bytes() == static_cast<int64_t>(bytes.size()) && listed->checksum() == ListedChecksum(bytes)))
    return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(
      path,
      ": is not as report.json lists it; `weft register` with the same inputs computes the frame again"));
}

}  // namespace weft
