#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "nets/net.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  auto net = weft::Net::FromOnnx({reinterpret_cast<const char*>(data), size}, "net");
  if (!net.ok()) return 0;
  weft::Tensor image{3, 8, 16, std::vector<float>(3 * 8 * 16, 0.25f)};
  const auto answer = net->Run(image);
  if (!answer.ok()) return 0;
  weft::FuzzRequire(
      std::all_of(answer->values.begin(), answer->values.end(), [](float x) { return std::isfinite(x); }));
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::ifstream file(WEFT_TEST_DATA "/unet.onnx", std::ios::binary);
  return {std::string(std::istreambuf_iterator<char>(file), {})};
}
