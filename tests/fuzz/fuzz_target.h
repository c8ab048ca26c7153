// A fuzz target: one parser, fed arbitrary bytes. It must neither crash nor hang, and what it accepts must be
// valid.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

// libFuzzer's entry point; defined once per target.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace weft {

// Well-formed inputs from which the mutations start; defined once per target.
std::vector<std::string> FuzzSeeds();

// Ends the program when a property of the parser does not hold, as a sanitizer would.
inline void FuzzRequire(bool holds) {
  if (!holds) std::abort();
}

// A path for the files of one target's process, in memory where the machine has such a folder.
inline std::filesystem::path FuzzFolder(const std::string& target) {
  const std::filesystem::path memory = "/dev/shm";
  return (access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path()) /
         ("weft_fuzz_" + target + "_" + std::to_string(getpid()));
}

}  // namespace weft
