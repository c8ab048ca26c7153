// Reads files of others for a daemon, in a process that they may take over.
#pragma once

#include "absl/status/status.h"
#include "weft/v1/reading.pb.h"

namespace weft {

// Confines this process to what the reading needs (services/ground/confinement), for good, and does it. Call
// it before other threads start. Errors stand in the answer; what is thrown does too.
v1::ReadingAnswer RunReading(const v1::Reading& reading);

// The status of an answer, and the answer of a status.
absl::Status StatusOf(const v1::ReadingAnswer& answer);
void SetStatus(const absl::Status& status, v1::ReadingAnswer& answer);

}  // namespace weft
