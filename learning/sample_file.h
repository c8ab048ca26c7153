// Samples that a net learns from, as `weft avatar train` writes them (layout: docs/file-formats.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace weft::learning {

enum class Split : uint32_t { kTrain = 0, kValidate = 1 };

// A file that is mapped into memory. Throws std::runtime_error, naming the file, for what is no file of
// samples or ends within one.
class SampleFile {
 public:
  explicit SampleFile(const std::string& path);
  ~SampleFile();
  SampleFile(const SampleFile&) = delete;
  SampleFile& operator=(const SampleFile&) = delete;

  int features() const { return features_; }
  int answers() const { return answers_; }
  int height() const { return height_; }
  int width() const { return width_; }
  // Of the image, in the order in which samples list them: those that show cloth or what lies beside it.
  const std::vector<int64_t>& texels() const { return texels_; }
  // [texels], whether it is of a panel: answers count there alone.
  const std::vector<float>& is_panel() const { return is_panel_; }

  int size() const { return static_cast<int>(samples_.size()); }
  Split split(int sample) const { return samples_[sample].split; }
  int cameras(int sample) const { return samples_[sample].cameras; }
  // Sixteen-bit floats: [features][texels], [answers][texels].
  const void* FeaturesOf(int sample) const { return samples_[sample].values; }
  const void* AnswersOf(int sample) const;

 private:
  struct Sample {
    Split split;
    int cameras;
    const char* values;
  };
  const char* data_ = nullptr;
  size_t bytes_ = 0;
  int features_ = 0, answers_ = 0, height_ = 0, width_ = 0;
  std::vector<int64_t> texels_;
  std::vector<float> is_panel_;
  std::vector<Sample> samples_;
};

}  // namespace weft::learning
