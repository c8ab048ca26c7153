#include "services/work/animation/sample_writer.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdio>
#include <fstream>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"

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

absl::Status WriteSamples(const std::string& path, std::string_view head, size_t runs, size_t at_once,
                          const SampleRun& make, const std::function<void(double share)>& on_progress) {
  const std::string draft = path + ".part";
  const absl::Cleanup remove = [&] { std::remove(draft.c_str()); };
  std::ofstream file(draft, std::ios::binary);
  file.write(head.data(), static_cast<std::streamsize>(head.size()));
  for (size_t first = 0; first < runs; first += at_once) {
    const size_t some = std::min(at_once, runs - first);
    std::vector<std::string> samples(some);
    std::vector<absl::Status> status(some);
    tbb::parallel_for(size_t{0}, some, [&](size_t k) { status[k] = make(first + k, &samples[k]); });
    for (size_t k = 0; k < some; ++k) {
      if (!status[k].ok()) return status[k];
      file.write(samples[k].data(), static_cast<std::streamsize>(samples[k].size()));
    }
    if (on_progress) on_progress(static_cast<double>(first + some) / static_cast<double>(runs));
  }
  file.close();
  if (!file || std::rename(draft.c_str(), path.c_str()) != 0)
    return absl::UnavailableError(absl::StrCat(path, ": can't be written; is the disk full?"));
  return absl::OkStatus();
}

}  // namespace weft
