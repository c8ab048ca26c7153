#include "services/work/animation/net_sample.h"

#include <cstdint>

#include "absl/strings/str_cat.h"
#include "services/formats/files/little_endian.h"

namespace weft {
namespace {

constexpr std::string_view kSampleMagic = "weftnet1";
constexpr size_t kSizesBytes = 3 * sizeof(uint32_t);

void PutTensor(const Tensor& tensor, std::string& out) {
  for (const int size : {tensor.channels, tensor.height, tensor.width})
    PutLittleEndian(static_cast<uint32_t>(size), out);
  for (const float value : tensor.values) PutLittleEndian(value, out);
}

// Takes one off `rest`; false where it ends within.
bool TakeTensor(std::string_view& rest, Tensor& tensor) {
  if (rest.size() < kSizesBytes) return false;
  const auto channels = TakeLittleEndian<uint32_t>(rest), height = TakeLittleEndian<uint32_t>(rest),
             width = TakeLittleEndian<uint32_t>(rest);
  const uint64_t most = rest.size() / sizeof(float);
  if (channels < 1 || height < 1 || width < 1 || channels > most || height > most || width > most ||
      uint64_t{height} * width > most / channels)
    return false;
  tensor.channels = static_cast<int>(channels);
  tensor.height = static_cast<int>(height), tensor.width = static_cast<int>(width);
  tensor.values.clear();
  for (uint64_t count = uint64_t{channels} * height * width; count > 0; --count)
    tensor.values.push_back(TakeLittleEndian<float>(rest));
  return true;
}

}  // namespace

std::string EncodeNetSample(const AvatarNet& net) {
  std::string out(kSampleMagic);
  PutTensor(net.sample, out);
  PutTensor(net.sample_answer, out);
  return out;
}

absl::Status DecodeNetSample(std::string_view bytes, const std::string& source_name, AvatarNet* net) {
  const auto bad = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", what));
  };
  if (!bytes.starts_with(kSampleMagic))
    return bad("holds no sample of a net; it does not begin with weftnet1");
  std::string_view rest = bytes.substr(kSampleMagic.size());
  if (!TakeTensor(rest, net->sample) || !TakeTensor(rest, net->sample_answer))
    return bad("ends within an image; was the file truncated?");
  return rest.empty() ? absl::OkStatus() : bad(absl::StrCat("has ", rest.size(), " bytes beyond its images"));
}

}  // namespace weft
