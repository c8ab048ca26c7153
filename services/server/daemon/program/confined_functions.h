// What the daemon itself reads of clients' files, it reads in threads that may read nothing else.
#pragma once

#include "services/server/daemon/program/daemon.h"

namespace weft {

// Wraps load_inputs, find_incomplete and endings: each call has the job's files alone (RunConfined).
// allow_paths and state_folder are without links.
void ConfineFunctions(DaemonOptions& options);

}  // namespace weft
