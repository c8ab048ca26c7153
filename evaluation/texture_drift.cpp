#include "evaluation/texture_drift.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>

#include "base/status_macros.h"

namespace weft {
namespace {

constexpr float kNoColour = std::numeric_limits<float>::quiet_NaN();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Catmull-Rom weights of the four samples around a place `t` after the second one. Linear interpolation would
// blur by the place between the pixels, which flow takes for motion.
std::array<float, 4> CubicWeights(float t) {
  return {((-0.5f * t + 1) * t - 0.5f) * t, (1.5f * t - 2.5f) * t * t + 1, ((-1.5f * t + 2) * t + 0.5f) * t,
          (0.5f * t - 0.5f) * t * t};
}

float Sample(const GreyImage& image, const Eigen::Vector2d& pixel_px) {
  const auto x = static_cast<int>(std::floor(pixel_px.x())), y = static_cast<int>(std::floor(pixel_px.y()));
  if (x < 1 || y < 1 || x + 2 >= image.width_px || y + 2 >= image.height_px) return kNoColour;
  const std::array<float, 4> across = CubicWeights(static_cast<float>(pixel_px.x() - x)),
                             down = CubicWeights(static_cast<float>(pixel_px.y() - y));
  float sum = 0;
  for (int j = 0; j < 4; ++j) {
    const float* row = &image.value[static_cast<size_t>(y + j - 1) * image.width_px + x - 1];
    sum += down[j] * (across[0] * row[0] + across[1] * row[1] + across[2] * row[2] + across[3] * row[3]);
  }
  return sum;
}

// Rest position by board position, least squares over the printed faces at each vertex.
std::vector<Eigen::Matrix<double, 3, 2>> MetricOf(const Template& garment, const ClothPrint& print) {
  const size_t vertices = garment.rest.vertices_mm.size();
  std::vector<Eigen::Matrix2d> spread(vertices, Eigen::Matrix2d::Zero());
  std::vector<Eigen::Matrix<double, 3, 2>> moment(vertices, Eigen::Matrix<double, 3, 2>::Zero());
  for (size_t f = 0; f < print.of_face.size(); ++f) {
    if (std::isnan(print.of_face[f][0].x())) continue;
    for (int i = 0; i < 3; ++i) {
      const int a = garment.rest.faces[f][i], b = garment.rest.faces[f][(i + 1) % 3];
      const Eigen::Vector2d on_board = print.of_face[f][(i + 1) % 3] - print.of_face[f][i];
      const Eigen::Vector3d at_rest = garment.rest.vertices_mm[b] - garment.rest.vertices_mm[a];
      for (const int v : garment.rest.faces[f]) {
        spread[v] += on_board * on_board.transpose();
        moment[v] += at_rest * on_board.transpose();
      }
    }
  }
  std::vector<Eigen::Matrix<double, 3, 2>> metric(vertices);
  for (size_t v = 0; v < vertices; ++v) {
    if (spread[v].determinant() > 1e-9) {
      metric[v] = moment[v] * spread[v].inverse();
    } else {
      metric[v].setConstant(kNone);
    }
  }
  return metric;
}

}  // namespace

// Brightness of a part of the board and where it is known; both [rows * t][cols * t].
struct TextureDrift::Texture {
  cv::Mat1f value;
  cv::Mat1f known;
};

absl::Status TextureDriftOptions::Validate() const {
  if (texels_per_cell < 2 || texels_per_cell > 64)
    return absl::InvalidArgumentError("texels_per_cell must lie between 2 and 64");
  if (block_cells < 4) return absl::InvalidArgumentError("block_cells must be at least 4");
  if (margin_cells < 1) return absl::InvalidArgumentError("margin_cells must be at least 1");
  if (views_per_block < 1 || views_per_block > 100)
    return absl::InvalidArgumentError("views_per_block must lie between 1 and 100");
  if (!(window_cells >= 1 && window_cells < 2 * margin_cells))
    return absl::InvalidArgumentError("window_cells must be at least 1 and less than twice margin_cells");
  if (!(max_return_cells > 0)) return absl::InvalidArgumentError("max_return_cells must be positive");
  return viewing.Validate();
}

absl::StatusOr<GreyImage> ToGrey(const Frame& frame) {
  WEFT_ASSIGN_OR_RETURN(const Frame rgb, ToRgb(frame));
  GreyImage out{rgb.width_px, rgb.height_px, {}};
  out.value.resize(static_cast<size_t>(out.width_px) * out.height_px);
  const uint8_t* pixel = rgb.pixels->data();
  for (size_t i = 0; i < out.value.size(); ++i, pixel += 3)
    out.value[i] = 0.3f * pixel[0] + 0.59f * pixel[1] + 0.11f * pixel[2];
  return out;
}

absl::StatusOr<TextureDrift> TextureDrift::Build(const Template& garment,
                                                 const TextureDriftOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const ClothPrint print = PrintFromVertexNodes(garment.rest.faces, garment.node_of_vertex);
  TextureDrift drift{PrintLocator(print)};
  if (drift.locator_.row_end() <= drift.locator_.row_begin())
    return absl::InvalidArgumentError(
        "the template has no face whose three vertices lie on neighbouring cells");
  drift.options_ = options;
  drift.faces_ = garment.rest.faces;
  drift.nodes_ = garment.node_of_vertex;
  drift.mm_per_cell_ = MetricOf(garment, print);
  std::map<std::pair<int, int>, std::vector<int>> vertices;
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v) {
    const VertexNode& node = garment.node_of_vertex[v];
    if (node.row >= 0 && !std::isnan(drift.mm_per_cell_[v](0, 0)))
      vertices[{node.row / options.block_cells, node.col / options.block_cells}].push_back(
          static_cast<int>(v));
  }
  for (auto& [place, inside] : vertices) {
    const int row = place.first * options.block_cells, col = place.second * options.block_cells;
    drift.blocks_.push_back(
        {row, row + options.block_cells, col, col + options.block_cells, std::move(inside)});
  }
  return drift;
}

UnwrapPlan TextureDrift::Plan(const Rig& rig, const VisibleMesh& before, const VisibleMesh& after,
                              const std::vector<std::vector<bool>>& uncovered) const {
  const size_t cameras = rig.cameras.size();
  std::vector<std::vector<float>> pitch_px(cameras);  // [cameras][vertices], 0 where not seen in both frames
  UnwrapPlan plan;
  plan.of_camera.resize(cameras);
  plan.seen.resize(cameras);
  for (size_t c = 0; c < cameras; ++c) {
    const std::vector<VertexView> a = before.Observe(rig.cameras[c], options_.viewing),
                                  b = after.Observe(rig.cameras[c], options_.viewing);
    const bool all_uncovered = uncovered.empty() || uncovered[c].empty();
    plan.seen[c].resize(a.size());
    pitch_px[c].resize(a.size());
    for (size_t v = 0; v < a.size(); ++v) {
      plan.seen[c][v] = a[v].seen && b[v].seen && (all_uncovered || uncovered[c][v]);
      pitch_px[c][v] = plan.seen[c][v] ? std::min(a[v].pitch_px, b[v].pitch_px) : 0;
    }
  }
  for (size_t b = 0; b < blocks_.size(); ++b) {
    std::vector<bool> coloured(blocks_[b].vertices.size(), false);
    for (int rank = 0; rank < options_.views_per_block; ++rank) {
      double best = 0.02 * options_.viewing.min_pitch_px * static_cast<double>(coloured.size());
      int chosen = -1;
      for (size_t c = 0; c < cameras; ++c) {
        double gain = 0;
        for (size_t i = 0; i < coloured.size(); ++i)
          if (!coloured[i]) gain += pitch_px[c][blocks_[b].vertices[i]];
        if (gain > best) best = gain, chosen = static_cast<int>(c);
      }
      if (chosen < 0) break;
      plan.of_camera[chosen].push_back({static_cast<int>(b), rank});
      for (size_t i = 0; i < coloured.size(); ++i)
        if (plan.seen[chosen][blocks_[b].vertices[i]]) coloured[i] = true;
    }
  }
  for (size_t c = 0; c < cameras; ++c)
    if (plan.of_camera[c].empty()) plan.seen[c].clear();
  return plan;
}

TextureDriftField TextureDrift::EmptyField() const {
  TextureDriftField field;
  field.mm.assign(nodes_.size(), kNone);
  field.rank.assign(nodes_.size(), std::numeric_limits<int8_t>::max());
  return field;
}

TextureDrift::Texture TextureDrift::Colour(int row_begin, int row_end, int col_begin, int col_end,
                                           const CameraModel& model,
                                           const std::vector<Eigen::Vector3d>& vertices_mm,
                                           const std::vector<bool>& seen, const GreyImage& image) const {
  const int t = options_.texels_per_cell;
  Texture texture;
  texture.value = cv::Mat1f::zeros((row_end - row_begin) * t, (col_end - col_begin) * t);
  texture.known = cv::Mat1f::zeros(texture.value.size());
  for (int y = 0; y < texture.value.rows; ++y) {
    for (int x = 0; x < texture.value.cols; ++x) {
      const BoardPoint place(col_begin + (x + 0.5) / t, row_begin + (y + 0.5) / t);
      const std::optional<SurfacePoint> point = locator_.Find(place);
      if (!point) continue;
      const Face& face = faces_[point->face];
      if (!seen[face[0]] || !seen[face[1]] || !seen[face[2]]) continue;
      const std::optional<Eigen::Vector2d> pixel_px = model.Project(PositionOf(*point, vertices_mm, faces_));
      const float value = pixel_px ? Sample(image, *pixel_px) : kNoColour;
      if (std::isnan(value)) continue;
      texture.value(y, x) = value;
      texture.known(y, x) = 1;
    }
  }
  return texture;
}

GreyImage TextureDrift::Unwrap(const CameraModel& model, const std::vector<Eigen::Vector3d>& vertices_mm,
                               const std::vector<bool>& seen, const GreyImage& image) const {
  const Texture texture = Colour(locator_.row_begin(), locator_.row_end(), locator_.col_begin(),
                                 locator_.col_end(), model, vertices_mm, seen, image);
  GreyImage out{texture.value.cols, texture.value.rows, {}};
  for (int y = 0; y < out.height_px; ++y)
    for (int x = 0; x < out.width_px; ++x)
      out.value.push_back(texture.known(y, x) > 0 ? texture.value(y, x) : kNoColour);
  return out;
}

namespace {

// Free of shading: local mean 0, local standard deviation 1; unknown texels are 0.
GreyImage Flattened(const cv::Mat1f& value, const cv::Mat1f& known, double sigma_texels, double fine_texels) {
  const auto blurred = [&](const cv::Mat1f& image) {
    cv::Mat1f out;
    cv::GaussianBlur(image, out, {}, sigma_texels, sigma_texels, cv::BORDER_REFLECT);
    return out;
  };
  const cv::Mat1f weight = blurred(known) + 1e-6f;
  const cv::Mat1f mean = blurred(value) / weight;
  const cv::Mat1f rest = (value - mean).mul(known);
  cv::Mat1f deviation;
  cv::sqrt(blurred(rest.mul(rest)) / weight, deviation);
  cv::Mat1f flat = rest / (deviation + 1.0f);
  // Content finer than the texels can carry would stay with them and hold the flow back.
  cv::GaussianBlur(flat, flat, {}, fine_texels, fine_texels, cv::BORDER_REFLECT);
  return {flat.cols, flat.rows, std::vector<float>(flat.begin(), flat.end())};
}

cv::Mat1b ToBytes(const GreyImage& image) {
  cv::Mat1b out;
  cv::Mat1f(image.height_px, image.width_px, const_cast<float*>(image.value.data()))
      .convertTo(out, CV_8U, 40, 128);
  return out;
}

// Lucas-Kanade at one point, from a flow that is right to a texel. OpenCV's ends at a hundredth of a
// texel, which at 30 frames a second is a tenth of a millimetre per second. Gauss-Newton on the window's
// squared difference.
Eigen::Vector2d RefineFlow(const GreyImage& before, const GreyImage& after, const Eigen::Vector2d& at,
                           const Eigen::Vector2d& flow, int half) {
  constexpr int kMaxSteps = 10;
  constexpr double kConverged = 1e-4;  // texels
  struct Texel {
    Eigen::Vector2d place;
    float value, slope_x, slope_y;
  };
  std::vector<Texel> window;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      const Eigen::Vector2d place = at + Eigen::Vector2d(x, y);
      const auto value = [&](double dx, double dy) {
        return Sample(before, place + Eigen::Vector2d(dx, dy));
      };
      const Texel texel{place, value(0, 0), (value(0.5, 0) - value(-0.5, 0)),
                        (value(0, 0.5) - value(0, -0.5))};
      window.push_back(texel);
      const Eigen::Vector2d slope(texel.slope_x, texel.slope_y);
      normal += slope * slope.transpose();
    }
  }
  const Eigen::Matrix2d inverse = normal.inverse();
  Eigen::Vector2d refined = flow;
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
    for (const Texel& texel : window) {
      const double difference = Sample(after, texel.place + refined) - texel.value;
      gradient += difference * Eigen::Vector2d(texel.slope_x, texel.slope_y);
    }
    const Eigen::Vector2d change = inverse * gradient;
    refined -= change;
    if (!(change.norm() > kConverged)) break;
  }
  return refined;
}

// Whether all texels of the square around a point are known in both textures.
bool AllKnown(const cv::Mat1d& known_sum, const cv::Point2f& at, int half) {
  const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y));
  const int left = x - half, top = y - half, right = x + half + 2, bottom = y + half + 2;
  if (left < 0 || top < 0 || right >= known_sum.cols || bottom >= known_sum.rows) return false;
  const double sum =
      known_sum(bottom, right) - known_sum(top, right) - known_sum(bottom, left) + known_sum(top, left);
  return sum > (right - left) * (bottom - top) - 0.5;
}

}  // namespace

TextureDrift::FlowCount TextureDrift::MeasureBlock(const Block& block, int rank, const Texture& before,
                                                   const Texture& after, TextureDriftField* field) const {
  const int t = options_.texels_per_cell;
  const double sigma_texels = 1.5 * t, fine_texels = 0.07 * t;
  const cv::Mat1f known = before.known.mul(after.known);
  const GreyImage flat_before = Flattened(before.value.mul(known), known, sigma_texels, fine_texels),
                  flat_after = Flattened(after.value.mul(known), known, sigma_texels, fine_texels);
  const cv::Mat1b a = ToBytes(flat_before), b = ToBytes(flat_after);
  cv::Mat1d known_sum;
  cv::integral(known, known_sum, CV_64F);

  const int window = static_cast<int>(std::lround(options_.window_cells * t)) | 1;
  std::vector<int> vertices;
  std::vector<cv::Point2f> start;
  for (const int v : block.vertices) {
    const auto texel = [&](double place, int begin) {
      return static_cast<float>((place - begin + options_.margin_cells) * t - 0.5);
    };
    const BoardPoint place = nodes_[v].PlaceInCells();
    const cv::Point2f at(texel(place.x(), block.col_begin), texel(place.y(), block.row_begin));
    if (!AllKnown(known_sum, at, window / 2)) continue;
    vertices.push_back(v);
    start.push_back(at);
  }
  FlowCount count;
  if (start.empty()) return count;
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 40, 1e-4);
  std::vector<cv::Point2f> end, back;
  std::vector<uint8_t> found, found_back;
  cv::calcOpticalFlowPyrLK(a, b, start, end, found, cv::noArray(), {window, window}, 2, until);
  cv::calcOpticalFlowPyrLK(b, a, end, back, found_back, cv::noArray(), {window, window}, 2, until);
  for (size_t i = 0; i < start.size(); ++i) {
    ++count.tried;
    const cv::Point2f gap = back[i] - start[i], way = end[i] - start[i];
    const Eigen::Vector2d coarse(way.x, way.y);
    Eigen::Vector2d flow(kNone, kNone);
    if (found[i] && found_back[i] && std::hypot(gap.x, gap.y) <= options_.max_return_cells * t)
      flow = RefineFlow(flat_before, flat_after, {start[i].x, start[i].y}, coarse, window / 2);
    if (!((flow - coarse).norm() <= options_.max_return_cells * t)) {
      ++count.lost;
      continue;
    }
    const int v = vertices[i];
    if (rank >= field->rank[v]) continue;
    field->mm[v] = (mm_per_cell_[v] * flow / t).norm();
    field->rank[v] = static_cast<int8_t>(rank);
  }
  return count;
}

void TextureDrift::Measure(const UnwrapPlan& plan, int camera, const CameraModel& model,
                           const std::vector<Eigen::Vector3d>& before_mm, const GreyImage& before,
                           const std::vector<Eigen::Vector3d>& after_mm, const GreyImage& after,
                           TextureDriftField* field) const {
  const std::vector<bool>& seen = plan.seen[camera];
  const int margin = options_.margin_cells;
  std::atomic<int64_t> tried = 0, lost = 0;
  // Blocks share no vertex, so every loop writes places of its own.
  tbb::parallel_for(size_t{0}, plan.of_camera[camera].size(), [&](size_t i) {
    const auto& [index, rank] = plan.of_camera[camera][i];
    const Block& block = blocks_[index];
    const auto colour = [&](const std::vector<Eigen::Vector3d>& vertices_mm, const GreyImage& image) {
      return Colour(block.row_begin - margin, block.row_end + margin, block.col_begin - margin,
                    block.col_end + margin, model, vertices_mm, seen, image);
    };
    const FlowCount count =
        MeasureBlock(block, rank, colour(before_mm, before), colour(after_mm, after), field);
    tried += count.tried;
    lost += count.lost;
  });
  field->tried += tried;
  field->lost += lost;
}

}  // namespace weft
