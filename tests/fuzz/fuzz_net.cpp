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
  constexpr int kSide = 64;
  const int channels = static_cast<int>(model->image_channels);
  if (channels > 64) return 0;  // for speed
  weft::Tensor image{channels, kSide, kSide,
                     std::vector<float>(static_cast<size_t>(channels * kSide * kSide), 0.25f)};
  const auto answer = net->Run(image);
  // Large weights overflow.
  weft::FuzzRequire(answer.ok() || IsOfLibrary(answer.status()) ||
                        answer.status().message().find("not finite") != absl::string_view::npos,
                    std::string(answer.status().message()));
  if (answer.ok()) {
    weft::FuzzRequire(
        std::all_of(answer->values.begin(), answer->values.end(), [](float x) { return std::isfinite(x); }));
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
