#include "capture/rig/exchange_cameras.h"

#include <algorithm>
#include <numeric>

#include "absl/strings/str_cat.h"

namespace weft {

absl::StatusOr<std::vector<size_t>> ExchangedPlaces(const Rig& rig, const std::vector<std::string>& ids) {
  if (ids.size() < 2)
    return absl::InvalidArgumentError("cameras: two or more are exchanged; name each of them once");
  std::vector<size_t> places(rig.cameras.size());
  std::iota(places.begin(), places.end(), size_t{0});
  for (size_t i = 0; i < ids.size(); ++i) {
    const std::string &id = ids[i], &next = ids[(i + 1) % ids.size()];
    if (std::count(ids.begin(), ids.end(), id) > 1)
      return absl::InvalidArgumentError(absl::StrCat("cameras: ", id, " is given twice"));
    const int camera = rig.IndexOf(id), place = rig.IndexOf(next);
    if (camera < 0) return absl::InvalidArgumentError(absl::StrCat("cameras: the rig has no camera ", id));
    if (place < 0) return absl::InvalidArgumentError(absl::StrCat("cameras: the rig has no camera ", next));
    const CameraModel &from = rig.cameras[camera], &to = rig.cameras[place];
    if (from.width_px != to.width_px || from.height_px != to.height_px)
      return absl::InvalidArgumentError(absl::StrCat(
          "cameras: images of ", id, " are ", from.width_px, "x", from.height_px, ", those of ", next, " ",
          to.width_px, "x", to.height_px, "; cameras of different sizes cannot have been exchanged"));
    places[camera] = static_cast<size_t>(place);
  }
  return places;
}

Rig WithPlaces(const Rig& rig, const std::vector<size_t>& places) {
  Rig out = rig;
  for (size_t c = 0; c < places.size(); ++c) {
    out.cameras[c] = rig.cameras[places[c]];
    out.cameras[c].id = rig.cameras[c].id;
  }
  return out;
}

}  // namespace weft
