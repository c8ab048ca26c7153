// Files of samples for weft-train (layout: docs/file-formats.md).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "animation/atlas/atlas.h"

namespace weft {

class SampleWriter {
 public:
  // The atlas must outlive it.
  SampleWriter(const Atlas& atlas, int features, int answers);

  std::string Head() const;
  // `about`: split, take, frame, cameras.
  void Append(const std::array<uint32_t, 4>& about, const AtlasImage& features, const AtlasImage& answers,
              std::string* out) const;

 private:
  void AppendTexels(const AtlasImage& image, std::string* out) const;

  const Atlas& atlas_;
  int features_, answers_;
  std::vector<int> texels_;  // that show cloth, or what lies beside it
};

// A run makes the samples of some frames, appended in their order.
using SampleRun = std::function<absl::Status(size_t run, std::string* samples)>;

// The file at `path`: the head and the samples of runs 0 to `runs` - 1 in turn, of which `at_once` are made
// in parallel and held in memory. The same bytes at any thread count. `on_progress` may be empty. The first
// error of a run, after which no file is left; Unavailable where it can't be written.
absl::Status WriteSamples(const std::string& path, std::string_view head, size_t runs, size_t at_once,
                          const SampleRun& make, const std::function<void(double share)>& on_progress);

}  // namespace weft
