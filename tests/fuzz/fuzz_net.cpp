#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "nets/net.h"
#include "nets/net_model.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

bool IsOfLibrary(const absl::Status& status) {
  return absl::IsInvalidArgument(status) && status.message().find("OpenCV(") != absl::string_view::npos;
}

}  // namespace

// What passes the check is imported and run, and says of itself the same again.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto model = weft::ReadNetModel(bytes);
  auto net = weft::Net::FromOnnx(bytes, "net");
  weft::FuzzRequire(model.ok() || !net.ok());
  if (!model.ok()) return 0;
  if (!net.ok()) {
    weft::FuzzRequire(IsOfLibrary(net.status()), std::string(net.status().message()));
    return 0;
  }
  const std::string written = weft::WriteNetModel(*model);
  const auto again = weft::ReadNetModel(written);
  weft::FuzzRequire(again.ok() && weft::WriteNetModel(*again) == written, "its own file is another");
  weft::NamedTensors inputs;
  for (const auto& [name, shape] : net->inputs()) {
    if (shape.channels > 64 || shape.height > 512 || shape.width > 512) return 0;  // for speed
    const auto side = [](int64_t told) { return static_cast<int>(told == weft::kAnySize ? 64 : told); };
    weft::Tensor& input = inputs[name];
    input = {static_cast<int>(shape.channels), side(shape.height), side(shape.width), {}};
    input.values.assign(static_cast<size_t>(input.channels * input.height * input.width), 0.25f);
  }
  const auto outputs = net->Run(inputs);
  // Large weights overflow.
  weft::FuzzRequire(outputs.ok() || IsOfLibrary(outputs.status()) ||
                        outputs.status().message().find("not finite") != absl::string_view::npos,
                    std::string(outputs.status().message()));
  if (!outputs.ok()) return 0;
  for (const auto& [name, output] : *outputs) {
    weft::FuzzRequire(
        std::all_of(output.values.begin(), output.values.end(), [](float x) { return std::isfinite(x); }));
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::vector<std::string> seeds;
  for (const char* name : {"/unet.onnx", "/shift.onnx", "/pixels.onnx"}) {
    std::ifstream file(std::string(WEFT_TEST_DATA) + name, std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return seeds;
}
