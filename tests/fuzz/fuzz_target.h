// A fuzz target: one parser, fed arbitrary bytes. It must neither crash nor hang, and what it accepts must be
// valid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
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

}  // namespace weft
