#include "simulation/studio_room.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "simulation/random.h"

namespace weft {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kSoftEdge_mm = 4;
constexpr float kTape_mm = 50;
constexpr float kDiscCosine = 0.86f;  // no lamp's disc reaches farther than 30 degrees

// 1 within `half` of 0, 0 outside, with a soft edge.
float Band(float distance_mm, float half_mm) {
  return std::clamp(0.5f + (half_mm - std::abs(distance_mm)) / kSoftEdge_mm, 0.0f, 1.0f);
}

// Distance to the nearest multiple of `step`.
float Nearest(float value, float step) { return value - step * std::round(value / step); }

}  // namespace

absl::Status RoomOptions::Validate() const {
  if (!(variation >= 0 && variation <= 1))
    return absl::InvalidArgumentError("room: variation must lie between 0 and 1");
  if (!(dome_radius_mm > 0)) return absl::InvalidArgumentError("room: dome_radius_mm must be positive");
  if (struts < 0 || struts > 360)
    return absl::InvalidArgumentError(absl::StrCat("room: struts is ", struts, ", expected 0 to 360"));
  if (!(strut_width_mm >= 0)) return absl::InvalidArgumentError("room: strut_width_mm must not be negative");
  return absl::OkStatus();
}

StudioRoom::StudioRoom(const RoomOptions& options, const LightOptions& light)
    : options_(options), light_(light) {
  const uint64_t key = KeyOf(options_.seed, "backdrop");
  for (uint64_t k = 0; k < waves_.size(); ++k) {
    waves_[k].around = static_cast<float>(std::round(3 + 14 * UniformOf(key, 3 * k)));
    waves_[k].drift = static_cast<float>(8 * UniformOf(key, 3 * k + 1) - 4);
    waves_[k].phase = static_cast<float>(2 * std::numbers::pi * UniformOf(key, 3 * k + 2));
  }
  for (Lamp& lamp : light_.lamps) lamp.direction.normalize();
}

Eigen::Vector3f StudioRoom::See(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction) const {
  const auto radius = static_cast<float>(options_.dome_radius_mm);
  const auto floor = static_cast<float>(options_.floor_below_mm);
  const Eigen::Vector3f origin = origin_mm - options_.center_mm;
  const float along = origin.dot(direction);
  const float inside = along * along - origin.squaredNorm() + radius * radius;
  const float to_dome = inside > 0 ? std::max(-along + std::sqrt(inside), 0.0f) : radius;
  const float to_floor = direction.y() > 0 ? (floor - origin.y()) / direction.y() : -1.0f;
  if (to_floor > 0 && to_floor < to_dome) {
    const Eigen::Vector3f place = origin + to_floor * direction;
    return Floor(place.x(), place.z());
  }
  return Dome((origin + to_dome * direction) / radius);
}

Eigen::Vector3f StudioRoom::Dome(const Eigen::Vector3f& place) const {
  const auto radius = static_cast<float>(options_.dome_radius_mm);
  const float azimuth = std::atan2(place.x(), place.z());
  const float height = std::clamp(place.y(), -1.0f, 1.0f);
  float sum = 0;
  for (const Wave& w : waves_) sum += std::sin(w.around * azimuth + w.drift * height + w.phase);
  Eigen::Vector3f light = options_.wall * (1 + options_.variation * sum / static_cast<float>(waves_.size()));
  if (options_.struts > 0) {
    const auto half = static_cast<float>(options_.strut_width_mm / 2);
    const float step = 2 * kPi / static_cast<float>(options_.struts);
    const float round_mm = radius * std::sqrt(std::max(0.0f, 1 - height * height));
    const float meridian = Band(Nearest(azimuth, step) * round_mm, half);
    const float parallel = Band(Nearest(std::asin(height), step) * radius, half);
    light += std::max(meridian, parallel) * (Eigen::Vector3f::Constant(options_.strut) - light);
  }
  for (const Lamp& lamp : light_.lamps) {
    // The fitting shows as a disc of a third of the soft source that it feeds.
    const float cosine = place.dot(lamp.direction) / place.norm();
    if (cosine < kDiscCosine) continue;
    const float angle = std::acos(std::min(cosine, 1.0f));
    const float disc = Band(angle * radius, lamp.half_angle_deg * kPi / 180 * radius / 3);
    light += disc * (Eigen::Vector3f::Constant(options_.lamp_glow) - light);
  }
  return light;
}

Eigen::Vector3f StudioRoom::Floor(float x_mm, float z_mm) const {
  const float cross =
      std::max(Band(x_mm, kTape_mm / 2) * Band(z_mm, 300), Band(z_mm, kTape_mm / 2) * Band(x_mm, 300));
  const float ring = Band(std::hypot(x_mm, z_mm) - 900, kTape_mm / 2);
  const Eigen::Vector3f carpet = 0.8f * options_.wall;
  return carpet + std::max(cross, ring) * (Eigen::Vector3f(0.22f, 0.21f, 0.12f) - carpet);
}

}  // namespace weft
