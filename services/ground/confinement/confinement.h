// What a process of Weft may still do when it reads files of others.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "services/ground/confinement/input_links.h"

namespace weft {

struct Confinement {
  // Absolute paths without links. Read: files, and folders with all below. Those that do not exist are left
  // to whoever reads them.
  std::vector<std::string> readable;
  std::vector<std::string> writable;  // folders
  LinkRules links;                    // where links among `readable` may lead besides
  bool may_run_programs = false;      // installed ones, and those beside this one
};

// Confines this process for good; call it before other threads start. It reads and writes the files above and
// the system's libraries; makes the system calls of allowed_calls.h alone; loses the capabilities of root but
// those for files; gains no privileges; leaves no core dump.
// What the kernel lacks (ConfinementGaps) is left out. FailedPrecondition: a path leads through a link.
// Unavailable: the kernel refuses what it offers.
absl::Status ConfineProcess(const Confinement& confinement);

// The same of what concerns files for a process that needs devices and the network: it reads everything and
// writes only below `writable` and to devices. Modes, owners, times and attributes of files stay; other
// processes' memory, mounts, modules, keys and the clock are out of its reach.
absl::Status ConfineWriting(const std::vector<std::string>& writable);

// What this kernel cannot confine, in words for the operator; empty: nothing.
std::string ConfinementGaps();

}  // namespace weft
