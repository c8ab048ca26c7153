// How much of a take was lost, and what to do about it.
#pragma once

#include "weft/v1/take.pb.h"

namespace weft {

// Adds to the verdict of `info` the share of its frame sets, dropped ones included, that have all cameras.
// The reason names the greatest loss, the remedy what to fix before the take is recorded again. Needs
// sets, sets_complete, sets_dropped and causes.
void AssessLosses(v1::TakeInfo& info);

}  // namespace weft
