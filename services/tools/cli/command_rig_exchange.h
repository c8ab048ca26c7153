// weft rig exchange.
#pragma once

#include "services/tools/cli/commands.h"

namespace weft {

void AddRigExchangeCommand(CLI::App& rig, CommandLine& line);

}  // namespace weft
