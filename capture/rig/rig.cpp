#include "capture/rig/rig.h"

#include <unordered_set>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"

namespace weft {

absl::Status Rig::Validate() const {
  if (cameras.empty())
    return absl::InvalidArgumentError("rig: cameras is empty; a rig needs at least one camera");
  std::unordered_set<std::string_view> ids;
  for (const CameraModel& camera : cameras) {
    WEFT_RETURN_IF_ERROR(camera.Validate());
    if (!ids.insert(camera.id).second) {
      return absl::InvalidArgumentError(
          absl::StrCat("rig: camera id ", camera.id, " occurs twice; ids must be unique"));
    }
  }
  return absl::OkStatus();
}

int Rig::IndexOf(std::string_view camera_id) const {
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].id == camera_id) return static_cast<int>(i);
  }
  return -1;
}

std::string Rig::ContentHash() const {
  weft::ContentHash hash;
  hash.AddInteger(cameras.size());
  for (const CameraModel& c : cameras) {
    hash.Add(c.id).AddInteger(c.width_px).AddInteger(c.height_px);
    hash.AddNumber(c.fx_px).AddNumber(c.fy_px).AddNumber(c.cx_px).AddNumber(c.cy_px);
    for (const double k : c.distortion) hash.AddNumber(k);
    for (int i = 0; i < 9; ++i) hash.AddNumber(c.rotation(i / 3, i % 3));
    for (int i = 0; i < 3; ++i) hash.AddNumber(c.translation_mm[i]);
  }
  return hash.Hex();
}

}  // namespace weft
