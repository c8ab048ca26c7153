// Where the files of a recorded take are.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

// <take>/streams holds a .stream and an .index per camera; <take>/ledger.csv accounts for every frame set.
std::string StreamFolder(const std::string& take);
std::string StreamFile(const std::string& stream_folder, const std::string& camera_id);
std::string IndexFile(const std::string& stream_folder, const std::string& camera_id);
std::string LedgerFile(const std::string& take);

// True for a folder that a recorder made, whatever its state.
bool IsRecordedTake(const std::string& folder);

// Ids of the cameras that have a stream, in order of their names, numbers by value. NotFound: no such folder,
// or no recorded take.
absl::StatusOr<std::vector<std::string>> CamerasOfTake(const std::string& take);

}  // namespace weft
