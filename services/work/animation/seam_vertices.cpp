#include "services/work/animation/seam_vertices.h"

#include <algorithm>
#include <cstddef>

#include "base/status_macros.h"

namespace weft {
namespace {

// Around a texel, as a square.
bool SeesSeam(const Atlas& atlas, int row, int column, int texels) {
  for (int r = std::max(0, row - texels); r <= std::min(atlas.height() - 1, row + texels); ++r)
    for (int c = std::max(0, column - texels); c <= std::min(atlas.width() - 1, column + texels); ++c)
      if (atlas.kinds()[static_cast<size_t>(r) * static_cast<size_t>(atlas.width()) +
                        static_cast<size_t>(c)] == TexelKind::kSeam)
        return true;
  return false;
}

}  // namespace

absl::StatusOr<std::vector<bool>> VerticesNearSeams(const Template& garment, const AtlasOptions& options,
                                                    int texels) {
  WEFT_ASSIGN_OR_RETURN(const Atlas atlas, Atlas::Build(garment, ChartsOnBoard(garment), options));
  AtlasImage image{1, atlas.height(), atlas.width(), {}};
  for (int r = 0; r < image.height; ++r)
    for (int c = 0; c < image.width; ++c) image.values.push_back(SeesSeam(atlas, r, c, texels) ? 1.0f : 0.0f);
  std::vector<bool> out;
  for (const float share : atlas.Scatter(std::move(image))) out.push_back(share > 0.5f);
  return out;
}

}  // namespace weft
