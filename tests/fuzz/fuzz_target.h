// A fuzz target: one parser, fed arbitrary bytes. It must neither crash nor hang, and what it accepts must be
// valid.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <source_location>
#include <string>
#include <vector>

// libFuzzer's entry point; defined once per target.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace weft {

// Well-formed inputs from which the mutations start; defined once per target.
std::vector<std::string> FuzzSeeds();

// What a target with threads of its own has to end before static objects go; the driver calls it after all
// inputs.
inline void (*fuzz_end)() = nullptr;

// Ends the program when a property of the parser does not hold, as a sanitizer would, and says where and
// what.
inline void FuzzRequire(bool holds, const std::string& what = "",
                        std::source_location where = std::source_location::current()) {
  if (holds) return;
  std::fprintf(stderr, "%s:%u: the property does not hold%s%s\n", where.file_name(),
               static_cast<unsigned>(where.line()), what.empty() ? "" : ": ", what.c_str());
  std::abort();
}

// A path for the files of one target's process, in memory where the machine has such a folder.
inline std::filesystem::path FuzzFolder(const std::string& target) {
  const std::filesystem::path memory = "/dev/shm";
  return (access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path()) /
         ("weft_fuzz_" + target + "_" + std::to_string(getpid()));
}

}  // namespace weft
