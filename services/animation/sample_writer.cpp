#include "services/animation/sample_writer.h"

#include <Eigen/Core>

namespace weft {
namespace {

template <class T>
void AppendBytesOf(const T& value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

SampleWriter::SampleWriter(const Atlas& atlas, int features, int answers)
    : atlas_(atlas), features_(features), answers_(answers) {
  for (size_t t = 0; t < atlas_.kinds().size(); ++t)
    if (atlas_.kinds()[t] != TexelKind::kEmpty) texels_.push_back(static_cast<int>(t));
}

std::string SampleWriter::Head() const {
  std::string out = "weftsmp1";
  for (const int n : {features_, answers_, atlas_.height(), atlas_.width(), static_cast<int>(texels_.size())})
    AppendBytesOf(static_cast<uint32_t>(n), &out);
  for (const int t : texels_) AppendBytesOf(static_cast<uint32_t>(t), &out);
  for (const int t : texels_) AppendBytesOf(static_cast<uint8_t>(atlas_.kinds()[t]), &out);
  return out;
}

void SampleWriter::Append(const std::array<uint32_t, 4>& about, const AtlasImage& features,
                          const AtlasImage& answers, std::string* out) const {
  for (const uint32_t n : about) AppendBytesOf(n, out);
  AppendTexels(features, out);
  AppendTexels(answers, out);
}

void SampleWriter::AppendTexels(const AtlasImage& image, std::string* out) const {
  for (int c = 0; c < image.channels; ++c)
    for (const int texel : texels_)  // sixteen-bit floats
      AppendBytesOf(
          Eigen::half(image.values[static_cast<size_t>(c) * image.PlaneSize() + static_cast<size_t>(texel)]),
          out);
}

}  // namespace weft
