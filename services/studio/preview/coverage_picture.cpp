#include "services/studio/preview/coverage_picture.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "capture/image/image_encoders.h"
#include "services/results/report/frame_pictures.h"
#include "services/results/report/mesh_colors.h"

namespace weft {
namespace {

constexpr int kBoard_px = 640;
constexpr double kShading = 0.45;  // enough for the shape, little enough to read the colours

const Eigen::Vector3f& ColorOf(size_t coverage_class) {
  static const std::array<Eigen::Vector3f, kCoverageClasses> kColors = {{{0.80f, 0.81f, 0.83f},
                                                                         {0.84f, 0.36f, 0.10f},
                                                                         {0.96f, 0.71f, 0.36f},
                                                                         {0.36f, 0.63f, 0.87f},
                                                                         {0.11f, 0.34f, 0.62f}}};
  return kColors[coverage_class];
}

// Cameras that read the node's cell; of a corner, those of the cell around it that fewest read. -1 without
// one.
int ViewsOf(const VertexNode& node, const Coverage& coverage) {
  const int reach = node.IsCorner() ? 1 : 0;
  int least = -1;
  for (int row = node.row - reach; row <= node.row; ++row) {
    for (int col = node.col - reach; col <= node.col; ++col) {
      if (row < 0 || col < 0 || row >= coverage.rows() || col >= coverage.cols()) continue;
      const int views = coverage.Views(row, col);
      if (views >= 0 && (least < 0 || views < least)) least = views;
    }
  }
  return least;
}

}  // namespace

std::string CoverageColor(size_t coverage_class) { return HexColor(ColorOf(coverage_class)); }

absl::StatusOr<std::vector<MeshPicture>> PaintGarment(const Template& garment, const Coverage& coverage) {
  std::vector<Eigen::Vector3f> colors;
  colors.reserve(garment.node_of_vertex.size());
  for (const VertexNode& node : garment.node_of_vertex) {
    const int views = ViewsOf(node, coverage);
    colors.push_back(views >= 0 ? ColorOf(CoverageClass(views)) : Eigen::Vector3f(0.35f, 0.37f, 0.40f));
  }
  return DrawBothSides(garment.rest, colors, kShading);
}

MeshPicture PaintBoard(const Coverage& coverage) {
  const int scale = std::max(1, kBoard_px / std::max({1, coverage.rows(), coverage.cols()}));
  const int width = coverage.cols() * scale, height = coverage.rows() * scale;
  std::vector<uint8_t> rgba(static_cast<size_t>(width) * static_cast<size_t>(height) * 4, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int views = coverage.Views(y / scale, x / scale);
      if (views < 0) continue;
      const Eigen::Vector3f& color = ColorOf(CoverageClass(views));
      uint8_t* pixel = rgba.data() + 4 * (static_cast<size_t>(y) * static_cast<size_t>(width) + x);
      for (int c = 0; c < 3; ++c) pixel[c] = static_cast<uint8_t>(std::lround(255 * color[c]));
      pixel[3] = 255;
    }
  const auto png = EncodePng({width, height, 4, 8, rgba}, PngEffort::kSmall);
  return {"The board", png.ok() ? std::string(png->begin(), png->end()) : "", width, height};
}

}  // namespace weft
