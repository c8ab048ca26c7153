// Cameras of a rig whose names, places or lenses were exchanged, by their cables or in a file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"

namespace weft {

// What of a camera model is that of another one. A place is rotation and translation; a lens is focal
// lengths, principal point and distortion.
enum class CameraPart {
  kCamera,  // all of it, the size of its images as well
  kPlaceAndLens,
  kPlace,
  kLens
};

// "camera", "place-and-lens", "place", "lens"; the inverse answers InvalidArgument with the list of names.
std::string_view CameraPartName(CameraPart part);
absl::StatusOr<CameraPart> CameraPartFromName(std::string_view name);

// `own` with that part of `other`; the name stays.
CameraModel WithPart(const CameraModel& own, const CameraModel& other, CameraPart part);

// For each camera of the rig, the one whose model it gets: of `ids` each gets that of the next, the last that
// of the first; all others keep theirs. InvalidArgument: fewer than two, one that the rig lacks or that is
// given twice.
absl::StatusOr<std::vector<size_t>> ExchangedPlaces(const Rig& rig, const std::vector<std::string>& ids);

// The rig with models, or parts of them, as `places` says. Names and their order stay.
Rig WithPlaces(const Rig& rig, const std::vector<size_t>& places, CameraPart part = CameraPart::kCamera);

}  // namespace weft
