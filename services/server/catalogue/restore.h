// The check before the catalogue is opened. A damaged, emptied or missing file, or one of an older Weft,
// is set aside, never deleted. A new one gets all readable rows and those of the newest backup.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// The caller holds the catalogue's FileLock. Returns what a user must know of the restoration, nothing for a
// sound or a new catalogue. A crash in the middle is made good by the next call. FailedPrecondition: written
// by a newer Weft, or in use by one that knows no FileLock. Otherwise errors of the disk; nothing is changed
// then.
absl::StatusOr<std::vector<std::string>> MakeCatalogueSound(const std::string& path);

}  // namespace weft
