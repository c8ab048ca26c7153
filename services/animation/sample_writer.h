// Files of samples for weft-train (layout: docs/file-formats.md).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "animation/atlas.h"

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

}  // namespace weft
