#include "simulation/appearance.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "simulation/random.h"

namespace weft {
namespace {

float SmoothStep(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// A zero-mean number of standard deviation 1 (uniform) for a place of an integer grid.
float PlaceNoise(uint64_t key, int64_t x, int64_t y) {
  const uint64_t counter = static_cast<uint64_t>(y) << 32 ^ static_cast<uint32_t>(x);
  return 3.4641016f * (static_cast<float>(MixBits(key ^ MixBits(counter)) >> 40) * 0x1.0p-24f - 0.5f);
}

// Smooth noise between the places of a unit grid.
float SmoothNoise(uint64_t key, float x, float y) {
  const float fx = std::floor(x), fy = std::floor(y);
  const auto ix = static_cast<int64_t>(fx), iy = static_cast<int64_t>(fy);
  const float u = x - fx, v = y - fy;
  return (1 - u) * (1 - v) * PlaceNoise(key, ix, iy) + u * (1 - v) * PlaceNoise(key, ix + 1, iy) +
         (1 - u) * v * PlaceNoise(key, ix, iy + 1) + u * v * PlaceNoise(key, ix + 1, iy + 1);
}

// Signed distance to a square with round corners, centred on the origin, in cells; negative inside.
float SquareDistance(float x, float y, float half, float corner) {
  const float dx = std::abs(x) - half + corner, dy = std::abs(y) - half + corner;
  const float ox = std::max(dx, 0.0f), oy = std::max(dy, 0.0f);
  return std::sqrt(ox * ox + oy * oy) + std::min(std::max(dx, dy), 0.0f) - corner;
}

// The k-th of n directions, distributed as the cosine of the angle to +z (Hammersley points, turned).
Eigen::Vector3f CosineDirection(int k, int n, float turn_u, float turn_v) {
  float bits = 0, digit = 0.5f;
  for (int i = k; i > 0; i >>= 1, digit *= 0.5f) bits += static_cast<float>(i & 1) * digit;
  float u = (static_cast<float>(k) + 0.5f) / static_cast<float>(n) + turn_u, v = bits + turn_v;
  u -= std::floor(u), v -= std::floor(v);
  const float radius = std::sqrt(u), angle = 2 * std::numbers::pi_v<float> * v;
  return {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(std::max(0.0f, 1 - u))};
}

float DomeRadiance(const LightOptions& o, const Eigen::Vector3f& direction) {
  float radiance = o.dome_radiance - o.dome_gradient * direction.y();
  for (const Lamp& lamp : o.lamps) {
    const float limit = std::cos(lamp.half_angle_deg * std::numbers::pi_v<float> / 180);
    radiance +=
        lamp.radiance * SmoothStep(limit - 0.02f, limit + 0.02f, direction.dot(lamp.direction.normalized()));
  }
  return radiance;
}

}  // namespace

absl::Status InkOptions::Validate() const {
  if (!(spread_cells > 0 && spread_cells <= 0.5))
    return absl::InvalidArgumentError(
        absl::StrCat("inks: spread_cells is ", spread_cells, ", expected 0 to 0.5"));
  if (!(corner_cells >= 0 && corner_cells <= 0.4))
    return absl::InvalidArgumentError(
        absl::StrCat("inks: corner_cells is ", corner_cells, ", expected 0 to 0.4"));
  if (!(cell_variation >= 0 && cell_variation < 0.5) || !(weave_variation >= 0 && weave_variation < 0.5))
    return absl::InvalidArgumentError("inks: cell_variation and weave_variation must lie between 0 and 0.5");
  return absl::OkStatus();
}

Eigen::Vector3f InkAt(const Board& board, const InkOptions& inks, float col, float row) {
  const int c = static_cast<int>(std::floor(col)), r = static_cast<int>(std::floor(row));
  if (!board.Contains(r, c)) return inks.line;
  const float x = col - static_cast<float>(c) - 0.5f, y = row - static_cast<float>(r) - 0.5f;
  const auto half = static_cast<float>(board.square_fraction / 2);
  const float distance = SquareDistance(x, y, half, static_cast<float>(inks.corner_cells));
  const auto spread = static_cast<float>(inks.spread_cells);
  const float line = SmoothStep(-spread, spread, distance);
  Eigen::Vector3f ink = (1 - line) * inks.color[static_cast<size_t>(board.at(r, c))] + line * inks.line;
  float shade = 1;
  if (inks.cell_variation > 0)
    shade += static_cast<float>(inks.cell_variation) * PlaceNoise(KeyOf(inks.seed, "cell"), c, r);
  if (inks.weave_variation > 0) {
    // Interpolated noise has 4/9 of the variance of its places.
    shade += 1.5f * static_cast<float>(inks.weave_variation) *
             SmoothNoise(KeyOf(inks.seed, "weave"), 6 * col, 6 * row);
  }
  return ink * std::max(shade, 0.1f);
}

absl::Status LightOptions::Validate() const {
  if (!(dome_radiance >= std::abs(dome_gradient)))
    return absl::InvalidArgumentError("light: dome_gradient must not exceed dome_radiance");
  if (rays < 1 || rays > 4096)
    return absl::InvalidArgumentError(absl::StrCat("light: rays is ", rays, ", expected 1 to 4096"));
  if (!(bounce >= 0 && bounce <= 1))
    return absl::InvalidArgumentError("light: bounce must lie between 0 and 1");
  for (const Lamp& lamp : lamps)
    if (!(lamp.direction.norm() > 0) || !(lamp.half_angle_deg > 0 && lamp.half_angle_deg < 90))
      return absl::InvalidArgumentError(
          "light: a lamp needs a direction and a half angle of 0 to 90 degrees");
  return absl::OkStatus();
}

VertexLight LightVertices(const RayScene& scene, const std::vector<Eigen::Vector3d>& vertices_mm,
                          const std::vector<Eigen::Vector3d>& normals, const LightOptions& options) {
  constexpr float kNear_mm = 0.02f;
  const uint64_t key = KeyOf(1, "light");
  VertexLight out;
  out.outside.resize(vertices_mm.size());
  out.inside.resize(vertices_mm.size());
  const auto light = [&](size_t v, const Eigen::Vector3f& normal) {
    const Eigen::Vector3f across = normal.unitOrthogonal();
    const Eigen::Vector3f along = normal.cross(across);
    const auto turn_u = static_cast<float>(UniformOf(key, 2 * v));
    const auto turn_v = static_cast<float>(UniformOf(key, 2 * v + 1));
    float sum = 0;
    for (int k = 0; k < options.rays; ++k) {
      const Eigen::Vector3f d = CosineDirection(k, options.rays, turn_u, turn_v);
      const Eigen::Vector3f world = d.x() * across + d.y() * along + d.z() * normal;
      const bool hidden = scene.Occluded(vertices_mm[v].cast<float>() + kNear_mm * normal, world, kNear_mm,
                                         std::numeric_limits<float>::infinity());
      sum += hidden ? options.bounce : DomeRadiance(options, world);
    }
    return sum / static_cast<float>(options.rays);
  };
  tbb::parallel_for(tbb::blocked_range<size_t>(0, vertices_mm.size(), 64), [&](const auto& range) {
    for (size_t v = range.begin(); v < range.end(); ++v) {
      const Eigen::Vector3f normal = normals[v].cast<float>();
      if (normal.squaredNorm() < 0.5f) continue;
      out.outside[v] = light(v, normal);
      out.inside[v] = light(v, -normal);
    }
  });
  return out;
}

}  // namespace weft
