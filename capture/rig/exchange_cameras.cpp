#include "capture/rig/exchange_cameras.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr std::pair<CameraPart, std::string_view> kParts[] = {{CameraPart::kCamera, "camera"},
                                                              {CameraPart::kPlaceAndLens, "place-and-lens"},
                                                              {CameraPart::kPlace, "place"},
                                                              {CameraPart::kLens, "lens"}};

}  // namespace

std::string_view CameraPartName(CameraPart part) {
  for (const auto& [value, name] : kParts)
    if (value == part) return name;
  return "";
}

absl::StatusOr<CameraPart> CameraPartFromName(std::string_view name) {
  for (const auto& [value, known] : kParts)
    if (known == name) return value;
  return absl::InvalidArgumentError(absl::StrCat("part of a camera: \"", std::string(name),
                                                 "\" is none of camera, place-and-lens, place, lens"));
}

CameraModel WithPart(const CameraModel& own, const CameraModel& other, CameraPart part) {
  CameraModel model = part == CameraPart::kPlace ? own : other;
  model.id = own.id;
  if (part == CameraPart::kCamera) return model;
  model.width_px = own.width_px, model.height_px = own.height_px;
  const CameraModel& place = part == CameraPart::kLens ? own : other;
  model.rotation = place.rotation, model.translation_mm = place.translation_mm;
  return model;
}

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
    places[camera] = static_cast<size_t>(place);
  }
  return places;
}

Rig WithPlaces(const Rig& rig, const std::vector<size_t>& places, CameraPart part) {
  Rig out = rig;
  for (size_t c = 0; c < places.size(); ++c)
    out.cameras[c] = WithPart(rig.cameras[c], rig.cameras[places[c]], part);
  return out;
}

}  // namespace weft
