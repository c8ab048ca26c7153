#include "capture/rig/krt.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto rig = weft::ParseKrt({reinterpret_cast<const char*>(data), size}, "KRT", 2668, 4096);
  if (rig.ok()) weft::FuzzRequire(rig->Validate().ok());
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {
      "400002\n4000 0 1185\n0 4001 2049\n0 0 1\n-0.1 0.2 0 0 0\n1 0 0 10\n0 1 0 20\n0 0 1 3000\n\n"
      "400004\n9000 0 900\n0 9001 2000\n0 0 1\n0 0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 100\n"};
}
