#include "services/preview/coverage_picture.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "services/report/frame_pictures.h"
#include "services/report/mesh_colors.h"

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
  cv::Mat cells(coverage.rows(), coverage.cols(), CV_8UC4, cv::Scalar::all(0));
  for (int row = 0; row < coverage.rows(); ++row)
    for (int col = 0; col < coverage.cols(); ++col) {
      const int views = coverage.Views(row, col);
      if (views < 0) continue;
      const Eigen::Vector3f rgb = 255 * ColorOf(CoverageClass(views));
      cells.at<cv::Vec4b>(row, col) = {cv::saturate_cast<uint8_t>(rgb.z()),
                                       cv::saturate_cast<uint8_t>(rgb.y()),
                                       cv::saturate_cast<uint8_t>(rgb.x()), 255};
    }
  const int scale = std::max(1, kBoard_px / std::max({1, coverage.rows(), coverage.cols()}));
  cv::resize(cells, cells, {}, scale, scale, cv::INTER_NEAREST);
  std::vector<uint8_t> png;
  cv::imencode(".png", cells, png);
  return {"The board", std::string(png.begin(), png.end()), cells.cols, cells.rows};
}

}  // namespace weft
