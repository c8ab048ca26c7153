// Programs that are installed beside this one.
#pragma once

#include <string>

namespace weft {

// The path of the program of this name in this program's folder; empty where /proc is missing.
std::string ProgramBeside(const char* name);

}  // namespace weft
