// Whether the content of an item is what its kind says.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

// What a job gives to the readers: the file of a rig or a board, else `folder`.
std::string InputPathOf(v1::ItemKind kind, const v1::ItemManifest& manifest, const std::string& folder);

// Reads the content as jobs do; of dumps, their list of frames. InvalidArgument names file and field.
absl::Status CheckItemContent(v1::ItemKind kind, const v1::ItemManifest& manifest, const std::string& folder);

}  // namespace weft
