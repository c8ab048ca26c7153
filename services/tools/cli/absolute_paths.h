// Paths of a job that mean the same in every folder.
#pragma once

#include <string>

#include "weft/v1/jobs.pb.h"

namespace weft {

// Against the working folder of this process, without "." and "..".
std::string AbsolutePath(const std::string& path);
// The inputs and the output as absolute paths; what a daemon holds ("library:...", "take:...") stays.
v1::RegistrationSpec WithAbsolutePaths(v1::RegistrationSpec spec);

}  // namespace weft
