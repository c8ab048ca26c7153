// What is known of the sigmas of driven jobs.
#pragma once

#include <string>

#include "weft/v1/job.pb.h"

namespace weft {

// What is known to be wrong with the sigma of a driven job; empty where nothing is.
std::string DrivenSigmaNote(const v1::Job& job);

}  // namespace weft
