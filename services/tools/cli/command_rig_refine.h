// weft rig refine.
#pragma once

#include "services/tools/cli/commands.h"

namespace weft {

void AddRigRefineCommand(CLI::App& rig, CommandLine& line);

}  // namespace weft
