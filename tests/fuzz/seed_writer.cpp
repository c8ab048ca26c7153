// Linked into targets of libFuzzer, whose main() knows no FuzzSeeds(): writes them into the folder that the
// environment variable WEFT_FUZZ_SEEDS names, for libFuzzer to start from.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* folder = std::getenv("WEFT_FUZZ_SEEDS");
  if (folder == nullptr) return 0;
  int number = 0;
  for (const std::string& seed : weft::FuzzSeeds())
    std::ofstream(std::filesystem::path(folder) / std::to_string(number++), std::ios::binary) << seed;
  return 0;
}
