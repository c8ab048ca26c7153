// weft rig refine.
#pragma once

#include "services/cli/commands.h"

namespace weft {

void AddRigRefineCommand(CLI::App& rig, CommandLine& line);

}  // namespace weft
