#include "simulation/renderer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "simulation/random.h"

namespace weft {
namespace {

// The lens of one camera: sigma and focus vary, and the focus is on the cloth where none is set.
LensOptions LensOf(const CameraOptions& options, const StudioScene& scene, const CameraModel& camera) {
  LensOptions lens = options.lens;
  const uint64_t key = KeyOf(options.sensor.seed, camera.id + " lens");
  lens.point_spread_sigma_px *= 1 + lens.point_spread_variation * (2 * UniformOf(key, 0) - 1);
  if (lens.focus_distance_mm == 0)
    lens.focus_distance_mm = (camera.rotation * scene.CenterMm() + camera.translation_mm).z();
  lens.focus_distance_mm += lens.focus_error_mm * (2 * UniformOf(key, 1) - 1);
  return lens;
}

}  // namespace

absl::Status CameraOptions::Validate() const {
  absl::Status status = tracing.Validate();
  status.Update(lens.Validate());
  status.Update(sensor.Validate());
  return status;
}

absl::StatusOr<Picture> RenderView(const StudioScene& scene, const CameraModel& camera,
                                   const CameraOptions& options, int64_t frame_number) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(TracedView view, TraceView(scene, camera, options.tracing));
  const LensOptions lens = LensOf(options, scene, camera);
  if (lens.f_number > 0) {
    const auto radius_at = [&](double depth_mm) {
      return static_cast<float>(DefocusRadiusPx(lens, camera.fx_px, lens.focus_distance_mm, depth_mm));
    };
    // The room is blurred as the cloth, so that outlines spread to both sides alike.
    const float room_px = radius_at((camera.rotation * scene.CenterMm() + camera.translation_mm).z());
    std::vector<float> radius_px(view.depth_mm.size());
    std::transform(view.depth_mm.begin(), view.depth_mm.end(), radius_px.begin(),
                   [&](float depth_mm) { return std::isinf(depth_mm) ? room_px : radius_at(depth_mm); });
    BlurDefocus(radius_px, &view.image);
  }
  Vignette(lens.vignetting, &view.image);
  BlurGaussian(lens.point_spread_sigma_px, &view.image);
  return DevelopImage(view.image, options.sensor, camera.id, frame_number);
}

}  // namespace weft
