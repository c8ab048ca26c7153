// Is a recorded take good, and if not, what to do.
#pragma once

#include <string>

#include "capture/take/recorded_take.h"
#include "weft/v1/take.pb.h"

namespace weft {

// "Run `weft take recover TAKE`..."; `force`: the take was closed.
std::string RecoverRemedy(const std::string& folder, bool force);

// Adds to the verdict of `info` the findings of streams, take.json and ledger, without reading the frames.
// They are whether the take was closed, whether streams are cut or missing, and how many sets have all
// cameras.
void AssessTake(const RecordedTake& take, v1::TakeInfo& info);

// Of what every byte says.
void AssessCheck(v1::TakeCheckReport& report, bool is_closed);

void AssessRecovery(v1::TakeRecoveryReport& report);

// Some process writes the take now.
bool IsBeingRecorded(const std::string& folder);

}  // namespace weft
