// What people call a take and say of it: slate, name and notes, in take.json.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/take.pb.h"

namespace weft {

// What is not given stays as it is.
struct TakeDescription {
  std::optional<std::string> slate, name, notes;
};

// InvalidArgument: slate or name of more than a line or 255 bytes, notes of more than 4096 bytes, text that
// is no UTF-8.
absl::Status CheckTakeDescription(const TakeDescription& description);

// The take as it is then. FailedPrecondition: it is being recorded, and its recorder would write over it.
// Errors of CheckTakeDescription, ReadTakeFile and WriteTakeFile.
absl::StatusOr<v1::Take> DescribeTakeFile(const std::string& folder, const TakeDescription& description);

// Do all `words`, apart by spaces, stand somewhere in `texts`, whatever their case? True without words.
bool HasWords(const std::string& words, const std::vector<std::string>& texts);

struct FoundTake {
  std::string folder;
  v1::Take take;
};
// Takes that are `folder` or lie in it, up to two folders deep, in the order of their paths: those in whose
// slate, name, notes, id, timecode, origin or folder's name the words stand. NotFound: no such folder.
absl::StatusOr<std::vector<FoundTake>> FindTakes(const std::string& folder, const std::string& words);

}  // namespace weft
