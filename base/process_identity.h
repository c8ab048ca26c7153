// Which process a number means: numbers are given again.
#pragma once

#include <cstdint>
#include <string>

namespace weft {

// What the kernel says in a file, which has no size there, without white space around it. Empty: nothing.
std::string KernelText(const std::string& path);

// When a process started, in ticks since boot (proc(5), stat, field 22). 0: no such process is seen; -1: it
// has ended, and nobody took note.
int64_t StartOfProcess(int64_t pid);

// Since when ticks are counted, and in which space process numbers are. Empty: the kernel does not say.
std::string BootId();
std::string PidNamespace();

}  // namespace weft
