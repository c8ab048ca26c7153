// What is behind the cloth: a dark room with a floor, and the dome of struts and lamps that lights it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "absl/status/status.h"
#include "simulation/studio_light.h"

namespace weft {

struct RoomOptions {
  Eigen::Vector3f wall = {0.045f, 0.048f, 0.055f};  // linear light from the curtain behind the dome
  float variation = 0.5f;                           // of its brightness, relative, 0 to 1
  Eigen::Vector3f center_mm = Eigen::Vector3f::Zero();
  double dome_radius_mm = 2600;  // around the centre
  int struts = 12;               // meridians and half as many circles of latitude; 0 for none
  double strut_width_mm = 45;
  float strut = 0.16f;           // light from the struts
  float lamp_glow = 0.9f;        // light from the lamps into the cameras
  double floor_below_mm = 1400;  // the centre; the floor is dark, with bright tape on it
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// Known by position, so all cameras see the same room. Immutable.
class StudioRoom {
 public:
  StudioRoom() = default;
  StudioRoom(const RoomOptions& options, const LightOptions& light);

  // Light along a ray from within the dome; `direction` has length 1. From outside the dome it shows the far
  // side.
  Eigen::Vector3f See(const Eigen::Vector3f& origin_mm, const Eigen::Vector3f& direction) const;

 private:
  // A wave of the wall's brightness around the vertical axis, drifting with the height.
  struct Wave {
    float around = 0, drift = 0, phase = 0;
  };
  Eigen::Vector3f Dome(const Eigen::Vector3f& place) const;
  Eigen::Vector3f Floor(float x_mm, float z_mm) const;

  RoomOptions options_;
  LightOptions light_;
  std::array<Wave, 3> waves_;
};

}  // namespace weft
