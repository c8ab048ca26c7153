// The folders in which a daemon keeps its takes.
#pragma once

#include <string>
#include <vector>

#include "services/studio/recorder/recorder_process.h"
#include "weft/v1/takes.pb.h"

namespace weft {

// Ids of the takes in a folder of takes, newest first.
std::vector<std::string> TakesIn(const std::string& folder);
bool TakeExists(const std::string& folder);

std::string KeepingFile(const std::string& folder);
// Is there once whoever wants to know of the take's end has been told (TakeStoreOptions.on_end).
std::string EndToldFile(const std::string& folder);
// A take whose file cannot be read counts as pinned: nobody deletes what may be pinned.
v1::TakeKeeping ReadKeeping(const std::string& folder);

v1::RecordedTake DescribeTakeFolder(const std::string& id, const std::string& folder, RecorderView view);

// Slate, name and notes of its keeping into its take.json. What cannot be written is logged: the keeping has
// it.
void DescribeInTake(const v1::RecordedTake& take);

}  // namespace weft
