// Commands that read what strangers made, in a process that may do little else.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace weft {

struct ConfinedFiles {
  std::vector<std::string> readable;  // files and folders of the command's inputs, also through links
  std::vector<std::string> writable;  // folders, made where they are missing
  bool may_run_programs = false;
};

// Runs `run` in a process of its own, confined (services/ground/confinement) to these files and the machine's
// memory, and gives its exit status; kExitFailed, with an error told, where it cannot be confined or crashes.
// Folders that were made for nothing are removed again. Signals go to both. Call it before other threads
// start.
int RunConfinedProcess(const ConfinedFiles& files, const std::function<int()>& run);

}  // namespace weft
