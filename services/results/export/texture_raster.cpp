#include "services/results/export/texture_raster.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr int kGutterPx = 4;

void PlaceFace(int face, const std::array<Eigen::Vector2f, 3>& uv, int size_px, std::vector<Texel>& texels) {
  std::array<Eigen::Vector2d, 3> corners;  // texels, with centres at whole numbers
  for (int k = 0; k < 3; ++k)
    corners[k] = {size_px * static_cast<double>(uv[k].x()) - 0.5,
                  size_px * (1 - static_cast<double>(uv[k].y())) - 0.5};
  const auto& [a, b, c] = corners;
  const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  if (!(std::abs(area) > 0)) return;
  const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  for (int y = std::max(0, static_cast<int>(std::ceil(low.y()))); y <= high.y() && y < size_px; ++y) {
    for (int x = std::max(0, static_cast<int>(std::ceil(low.x()))); x <= high.x() && x < size_px; ++x) {
      const double weight_b = ((x - a.x()) * (c.y() - a.y()) - (y - a.y()) * (c.x() - a.x())) / area;
      const double weight_c = ((b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x())) / area;
      if (weight_b < 0 || weight_c < 0 || weight_b + weight_c > 1) continue;
      texels[static_cast<size_t>(y) * size_px + x] = {face, static_cast<float>(weight_b),
                                                      static_cast<float>(weight_c)};
    }
  }
}

void GrowByOneTexel(int size_px, std::vector<Eigen::Vector4f>& values) {
  const std::vector<Eigen::Vector4f> before = values;
  const auto at = [size_px](int x, int y) { return static_cast<size_t>(y) * size_px + x; };
  for (int y = 0; y < size_px; ++y) {
    for (int x = 0; x < size_px; ++x) {
      if (before[at(x, y)].w() > 0) continue;
      Eigen::Vector4f sum = Eigen::Vector4f::Zero();
      for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, size_px - 1); ++ny)
        for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, size_px - 1); ++nx)
          if (before[at(nx, ny)].w() > 0) sum += before[at(nx, ny)];
      if (sum.w() > 0) values[at(x, y)] = sum / sum.w();
    }
  }
}

}  // namespace

absl::StatusOr<std::vector<Texel>> RasterizeTexture(int size_px, const std::vector<Face>& faces,
                                                    const MeshTexture& texture, const char* option) {
  if (size_px < 1 || size_px > kMaxAtlasPx)
    return absl::InvalidArgumentError(absl::StrCat(option, ": must lie between 1 and ", kMaxAtlasPx, " px"));
  if (texture.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        option,
        ": the meshes have no texture coordinates; register with a template that `weft template build` made, "
        "or one with its board"));
  }
  std::vector<Texel> texels(static_cast<size_t>(size_px) * size_px);
  for (size_t f = 0; f < faces.size(); ++f) {
    const auto [a, b, c] = faces[f];
    PlaceFace(static_cast<int>(f),
              texture.of_corner.empty()
                  ? std::array{texture.of_vertex[a], texture.of_vertex[b], texture.of_vertex[c]}
                  : texture.of_corner[f],
              size_px, texels);
  }
  return texels;
}

void AddGutter(int size_px, std::vector<Eigen::Vector4f>& values) {
  for (int i = 0; i < kGutterPx; ++i) GrowByOneTexel(size_px, values);
}

}  // namespace weft
