#include "tests/benchmark/disturbed_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace weft {

double Uniform(Random& random) { return std::ldexp(static_cast<double>(random.Next() >> 11), -53); }

void Disturb(const Disturbance& by, uint64_t seed, std::vector<std::vector<ViewObservations>>& frames,
             Rig& rig) {
  Random random(seed);
  for (std::vector<ViewObservations>& views : frames) {
    for (ViewObservations& view : views) {
      std::vector<Observation> kept;
      double middle_px = 0;
      for (const Observation& o : view.observations) middle_px += o.x_px;
      middle_px /= std::max<double>(1, static_cast<double>(view.observations.size()));
      for (Observation o : view.observations) {
        if (Uniform(random) > by.kept_share) continue;
        if (view.camera < by.half_hidden && o.x_px < middle_px) continue;
        if (view.camera >= static_cast<int>(views.size()) - by.half_seeing && Uniform(random) > 0.5) continue;
        if (Uniform(random) < by.wrong_share)
          o.x_px += 400 * (Uniform(random) - 0.5), o.y_px += 400 * (Uniform(random) - 0.5);
        // The sum of twelve uniform numbers is nearly normal.
        double noise[2] = {-6, -6};
        for (double& axis : noise)
          for (int k = 0; k < 12; ++k) axis += Uniform(random);
        o.x_px += by.noise_px * noise[0], o.y_px += by.noise_px * noise[1];
        kept.push_back(o);
      }
      view.observations = std::move(kept);
    }
  }
  if (by.knock_deg == 0) return;
  CameraModel& camera = rig.cameras[rig.cameras.size() / 2];
  const Eigen::Vector3d center = camera.CenterWorld();
  camera.rotation =
      Eigen::AngleAxisd(by.knock_deg * std::numbers::pi / 180, Eigen::Vector3d(1, 1, 0.3).normalized())
          .toRotationMatrix() *
      camera.rotation;
  camera.translation_mm = -camera.rotation * center;
}

}  // namespace weft
