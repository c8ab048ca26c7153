#include "services/results/export/texture_atlas.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "base/status_macros.h"

namespace weft {
namespace {

const ViewingOptions kForTexture{.max_facing_deg = 80, .min_pitch_px = 0, .clearance_mm = 2};

// Bilinear; empty outside the picture.
std::optional<Eigen::Vector3f> SampleRgb(const Frame& rgb, const Eigen::Vector2d& pixel_px) {
  const int x = static_cast<int>(std::floor(pixel_px.x())), y = static_cast<int>(std::floor(pixel_px.y()));
  if (x < 0 || y < 0 || x + 1 >= rgb.width_px || y + 1 >= rgb.height_px) return std::nullopt;
  const auto fx = static_cast<float>(pixel_px.x() - x), fy = static_cast<float>(pixel_px.y() - y);
  const uint8_t *above = rgb.row(y) + 3 * x, *below = rgb.row(y + 1) + 3 * x;
  Eigen::Vector3f color;
  for (int channel = 0; channel < 3; ++channel) {
    const float top = (1 - fx) * above[channel] + fx * above[channel + 3];
    const float bottom = (1 - fx) * below[channel] + fx * below[channel + 3];
    color[channel] = (1 - fy) * top + fy * bottom;
  }
  return color;
}

}  // namespace

// Pull and push (Grossman and Dally, Point Sample Rendering, 1998): means over squares that double in size,
// each of the known texels alone; unknown texels take the mean of the smallest square that has one.
std::vector<uint8_t> FilledRgb(const AtlasPicture& picture) {
  const cv::Mat rgba(picture.size_px, picture.size_px, CV_8UC4, const_cast<uint8_t*>(picture.rgba.data()));
  std::vector<cv::Mat> colors(1), known(1);  // colours times `known`, from 0 to 1, of each level
  cv::Mat alpha;
  cv::cvtColor(rgba, colors[0], cv::COLOR_RGBA2RGB);
  cv::extractChannel(rgba, alpha, 3);
  colors[0].convertTo(colors[0], CV_32FC3);
  alpha.convertTo(known[0], CV_32FC1, 1.0 / 255);
  const auto weighted = [](const cv::Mat& color, const cv::Mat& weight) {
    cv::Mat weights, product;
    cv::merge(std::vector<cv::Mat>(3, weight), weights);
    cv::multiply(color, weights, product);
    return product;
  };
  colors[0] = weighted(colors[0], known[0]);
  while (colors.back().rows > 1) {
    const int side = (colors.back().rows + 1) / 2;
    cv::Mat smaller, share;
    cv::resize(colors.back(), smaller, {side, side}, 0, 0, cv::INTER_AREA);
    cv::resize(known.back(), share, {side, side}, 0, 0, cv::INTER_AREA);
    colors.push_back(smaller);
    known.push_back(share);
  }
  cv::Mat filled;
  for (size_t level = colors.size(); level-- > 0;) {
    cv::Mat divisor, own = colors[level];
    cv::merge(std::vector<cv::Mat>(3, cv::max(known[level], 1e-6)), divisor);
    cv::divide(own, divisor, own);
    if (filled.empty()) {
      filled = own;
      continue;
    }
    cv::resize(filled, filled, own.size(), 0, 0, cv::INTER_LINEAR);
    own.copyTo(filled, known[level] > 0);
  }
  filled.convertTo(filled, CV_8UC3);
  return {filled.datastart, filled.dataend};
}

absl::StatusOr<TextureAtlas> TextureAtlas::Make(int size_px, const std::vector<Face>& faces,
                                                const MeshTexture& texture) {
  WEFT_ASSIGN_OR_RETURN(std::vector<Texel> texels, RasterizeTexture(size_px, faces, texture, "--texture"));
  TextureAtlas atlas;
  atlas.size_px_ = size_px;
  atlas.faces_ = faces;
  atlas.texels_ = std::move(texels);
  atlas.colors_.assign(atlas.texels_.size(), Eigen::Vector4f::Zero());
  return atlas;
}

absl::Status TextureAtlas::Add(const Frame& picture, const VisibleMesh& mesh, const CameraModel& camera) {
  WEFT_ASSIGN_OR_RETURN(const Frame rgb, ToRgb(picture));
  const std::vector<VertexView> views = mesh.Observe(camera, kForTexture);
  const std::vector<Eigen::Vector3d>& vertices_mm = mesh.vertices_mm();
  tbb::parallel_for(tbb::blocked_range<size_t>(0, texels_.size(), 4096), [&](const auto& range) {
    for (size_t t = range.begin(); t < range.end(); ++t) {
      const Texel& texel = texels_[t];
      if (texel.face < 0) continue;
      const auto [a, b, c] = faces_[texel.face];
      if (!views[a].seen || !views[b].seen || !views[c].seen) continue;
      const float weight_a = 1 - texel.weight_b - texel.weight_c;
      const auto blend = [&](const auto& of_a, const auto& of_b, const auto& of_c) {
        return weight_a * of_a + texel.weight_b * of_b + texel.weight_c * of_c;
      };
      const Eigen::Vector3d place_mm = static_cast<double>(weight_a) * vertices_mm[a] +
                                       static_cast<double>(texel.weight_b) * vertices_mm[b] +
                                       static_cast<double>(texel.weight_c) * vertices_mm[c];
      const auto pixel_px = camera.Project(place_mm);
      const auto color = pixel_px ? SampleRgb(rgb, *pixel_px) : std::nullopt;
      if (!color) continue;
      const float cosine = blend(views[a].facing_cosine, views[b].facing_cosine, views[c].facing_cosine);
      const float pitch_px = blend(views[a].pitch_px, views[b].pitch_px, views[c].pitch_px);
      const float weight = std::pow(cosine, 4.0F) * pitch_px * pitch_px;
      colors_[t].head<3>() += weight * *color;
      colors_[t].w() += weight;
    }
  });
  return absl::OkStatus();
}

AtlasPicture TextureAtlas::Take() {
  size_t of_garment = 0, seen = 0;
  for (size_t t = 0; t < texels_.size(); ++t) {
    of_garment += texels_[t].face >= 0;
    if (!(colors_[t].w() > 0)) continue;
    ++seen;
    colors_[t] /= colors_[t].w();
  }
  AddGutter(size_px_, colors_);
  AtlasPicture picture{size_px_, std::vector<uint8_t>(4 * colors_.size()),
                       of_garment > 0 ? static_cast<double>(seen) / static_cast<double>(of_garment) : 0};
  for (size_t t = 0; t < colors_.size(); ++t) {
    if (!(colors_[t].w() > 0)) continue;
    for (int channel = 0; channel < 3; ++channel)
      picture.rgba[4 * t + channel] =
          static_cast<uint8_t>(std::lround(std::clamp(colors_[t][channel], 0.0F, 255.0F)));
    picture.rgba[4 * t + 3] = 255;
  }
  std::ranges::fill(colors_, Eigen::Vector4f::Zero());
  return picture;
}

}  // namespace weft
