// The charts of a garment's cloth as one image: what is known of vertices becomes an image, and back.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"
#include "animation/atlas/cloth_charts.h"

namespace weft {

struct AtlasOptions {
  int level = 1;     // a texel is 2^level cells wide
  int gutter = 3;    // texels around each panel that show the cloth beyond its seams
  int multiple = 8;  // width and height are multiples of it, so that images can be halved

  absl::Status Validate() const;
};

struct AtlasImage {
  int channels = 0, height = 0, width = 0;
  std::vector<float> values;  // [channels][height][width]

  size_t PlaneSize() const { return static_cast<size_t>(height) * static_cast<size_t>(width); }
};

enum class TexelKind : uint8_t {
  kEmpty,
  kPanel,
  kSeam,    // beside a panel, shows the panel that is sewn to it
  kBorder,  // beside a panel, repeats its border
};

// Built once per garment. Its panels are the charts of the cloth; a garment without seams is one panel.
// Vectors must be in axes that do not turn from panel to panel (those of the mesh at rest), since what lies
// beyond a seam is shown without a rotation.
class Atlas {
 public:
  // `charts` are those of the garment. InvalidArgument: options that are not valid, charts that need more
  // than kMostTexels.
  static absl::StatusOr<Atlas> Build(const GarmentMesh& garment, const ClothCharts& charts,
                                     const AtlasOptions& options);
  static constexpr int64_t kMostTexels = int64_t{1} << 26;

  int width() const { return width_; }
  int height() const { return height_; }
  int panels() const { return panels_; }
  const std::vector<TexelKind>& kinds() const { return kinds_; }  // [height][width]

  // `per_vertex` is [vertices][channels]. A panel's texel is the mean of its vertices, or where fewer than
  // two lie in it what its face has in its middle; seams and borders are filled in, the rest is 0.
  AtlasImage Gather(std::span<const float> per_vertex, int channels) const;
  // Interpolates linearly between texels of panels, and of what is sewn to them; what the image has beside
  // panels does not matter. Vertices without a node take what goes on linearly from those around them.
  // [vertices][channels]. Of a board at level 0 a vertex that alone has its texel gets what
  // was gathered.
  std::vector<float> Scatter(AtlasImage image) const;
  // Fills seams and borders of an image whose panels are set.
  void FillGutter(AtlasImage* image) const;

 private:
  struct Weighted {
    int texel = 0;
    float weight = 0;
  };
  struct Layout;
  void FindSources(const GarmentMesh& garment, const Layout& layout);
  void FindGutter(const GarmentMesh& garment, const Layout& layout, const AtlasOptions& options);

  int width_ = 0, height_ = 0, panels_ = 0;
  std::vector<TexelKind> kinds_;
  std::vector<int> texel_of_vertex_;        // [vertices], the first; -1: none
  std::vector<std::pair<int, int>> seats_;  // vertex, texel
  // The other texels, with vertices of their face and their weights.
  std::vector<std::pair<int, std::array<std::pair<int, float>, 3>>> fills_;
  std::vector<std::vector<Weighted>> of_vertex_;               // [vertices], what Scatter reads
  std::vector<std::pair<int, std::vector<Weighted>>> gutter_;  // texel, what it shows
};

}  // namespace weft
