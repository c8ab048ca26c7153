#include "simulation/studio_light.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "simulation/random.h"

namespace weft {
namespace {

constexpr float kOffsetOfShadowRays_mm = 0.02f;

float SmoothStep(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// The k-th of n directions, distributed as the cosine of the angle to +z (Hammersley points, turned).
Eigen::Vector3f CosineDirection(int k, int n, float turn_u, float turn_v) {
  float u = (static_cast<float>(k) + 0.5f) / static_cast<float>(n) + turn_u, v = RadicalInverse(k) + turn_v;
  u -= std::floor(u), v -= std::floor(v);
  const float radius = std::sqrt(u), angle = 2 * std::numbers::pi_v<float> * v;
  return {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(std::max(0.0f, 1 - u))};
}

struct PlaceLight {
  float light = 0;
  Eigen::Vector3f flux = Eigen::Vector3f::Zero();
};

// Rays are distributed as the cosine to the normal, so light is their mean and flux the mean over cosines.
PlaceLight LightPlace(const RayScene& scene, const Eigen::Vector3f& place_mm, const Eigen::Vector3f& normal,
                      const LightOptions& options, int rays, float turn_u, float turn_v) {
  constexpr float kLeastCosine = 0.15f;  // grazing rays would be noise
  const Eigen::Vector3f across = normal.unitOrthogonal();
  const Eigen::Vector3f along = normal.cross(across);
  PlaceLight out;
  for (int first = 0; first < rays; first += RayScene::kPacket) {
    RayScene::Packet packet;
    std::array<float, RayScene::kPacket> cosine;
    for (int k = first; k < std::min(rays, first + RayScene::kPacket); ++k) {
      const Eigen::Vector3f d = CosineDirection(k, rays, turn_u, turn_v);
      cosine[packet.count] = std::max(d.z(), kLeastCosine);
      packet.Add(place_mm + kOffsetOfShadowRays_mm * normal, d.x() * across + d.y() * along + d.z() * normal,
                 kOffsetOfShadowRays_mm, std::numeric_limits<float>::infinity());
    }
    const uint32_t hidden = scene.Occluded(packet);
    for (int i = 0; i < packet.count; ++i) {
      const Eigen::Vector3f& world = packet.direction[i];
      const float radiance = (hidden >> i & 1) != 0 ? options.bounce : DomeRadiance(options, world);
      out.light += radiance;
      out.flux += radiance / cosine[i] * world;
    }
  }
  out.light /= static_cast<float>(rays);
  out.flux /= static_cast<float>(rays);
  return out;
}

}  // namespace

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

float DomeRadiance(const LightOptions& options, const Eigen::Vector3f& direction) {
  float radiance = options.dome_radiance - options.dome_gradient * direction.y();
  for (const Lamp& lamp : options.lamps) {
    const float limit = std::cos(lamp.half_angle_deg * std::numbers::pi_v<float> / 180);
    radiance +=
        lamp.radiance * SmoothStep(limit - 0.02f, limit + 0.02f, direction.dot(lamp.direction.normalized()));
  }
  return radiance;
}

VertexLight LightVertices(const RayScene& scene, const std::vector<Eigen::Vector3d>& vertices_mm,
                          const std::vector<Eigen::Vector3d>& normals, size_t cloth_vertices,
                          const LightOptions& options) {
  const uint64_t key = KeyOf(1, "light");
  const size_t count = vertices_mm.size();
  VertexLight out;
  out.outside.resize(count), out.inside.resize(count);
  out.flux.resize(count, Eigen::Vector3f::Zero());
  const int inner_rays = (options.rays + 2) / 3, body_rays = (options.rays + 1) / 2;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 64), [&](const auto& range) {
    for (size_t v = range.begin(); v < range.end(); ++v) {
      const Eigen::Vector3f normal = normals[v].cast<float>(), place = vertices_mm[v].cast<float>();
      if (normal.squaredNorm() < 0.5f) continue;
      const auto turn_u = static_cast<float>(UniformOf(key, 2 * v));
      const auto turn_v = static_cast<float>(UniformOf(key, 2 * v + 1));
      const bool is_cloth = v < cloth_vertices;
      const PlaceLight outside =
          LightPlace(scene, place, normal, options, is_cloth ? options.rays : body_rays, turn_u, turn_v);
      out.outside[v] = outside.light;
      out.flux[v] = outside.flux - outside.flux.dot(normal) * normal;
      if (is_cloth)
        out.inside[v] = LightPlace(scene, place, -normal, options, inner_rays, turn_u, turn_v).light;
    }
  });
  return out;
}

}  // namespace weft
