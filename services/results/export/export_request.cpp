#include "services/results/export/export_request.h"

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/results/export/export_transform.h"
#include "services/results/export/texture_atlas.h"

namespace weft {

absl::Status CheckNormalMap(int normal_map_px, int max_vertices) {
  constexpr int kTriangle = 3;
  if (max_vertices != 0 && max_vertices < kTriangle)
    return absl::InvalidArgumentError("--max-vertices: a mesh has at least 3; 0: all");
  if (normal_map_px < 0 || normal_map_px > kMaxAtlasPx) {
    return absl::InvalidArgumentError(
        absl::StrCat("--normal-map: must lie between 1 and ", kMaxAtlasPx, " px"));
  }
  if (normal_map_px == 0 || max_vertices != 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      "--normal-map: holds what a coarser mesh lacks; say with --max-vertices how many vertices that has");
}

absl::Status ExportRequest::Validate() const {
  if (result.empty()) return absl::InvalidArgumentError("the folder of the result is empty");
  if (out.empty()) return absl::InvalidArgumentError("--out: the folder of the export is empty");
  if (!(fps >= 0 && fps <= 1e6))
    return absl::InvalidArgumentError("--fps: must lie between 0 and 1000000 frames per second");
  const FormatTraits& traits = TraitsOf(format);
  if (traits.fixed_axes &&
      (up.value_or(traits.up) != traits.up || unit.value_or(LengthUnit::kMetre) != LengthUnit::kMetre)) {
    return absl::InvalidArgumentError(absl::StrCat("--up, --unit: ", traits.name,
                                                   " is y up and in metres by its specification; leave "
                                                   "them out, readers turn and scale it themselves"));
  }
  if (meshopt && format != ExportFormat::kGlb) {
    return absl::InvalidArgumentError(
        absl::StrCat("--meshopt: compresses glb alone, not ", traits.name, "; leave it out"));
  }
  if (texture_px != 0 && format != ExportFormat::kGlb) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--texture: stands in glb, or in files of its own with --format png; ", traits.name, " holds none"));
  }
  if (normal_map_px != 0 && format != ExportFormat::kGlb) {
    return absl::InvalidArgumentError(
        absl::StrCat("--normal-map: stands in glb, or in files of its own with --format png; ", traits.name,
                     " holds none"));
  }
  WEFT_RETURN_IF_ERROR(CheckNormalMap(normal_map_px, max_vertices));
  if (texture_px < 0 || texture_px > kMaxAtlasPx)
    return absl::InvalidArgumentError(absl::StrCat("--texture: must lie between 1 and ", kMaxAtlasPx, " px"));
  if (texture_frames < 1) return absl::InvalidArgumentError("--texture-frames: must be at least 1");
  for (const ExportAttribute attribute : attributes) {
    if (!traits.Carries(attribute)) {
      return absl::InvalidArgumentError(absl::StrCat("--attributes: ", traits.name, " does not carry ",
                                                     NameOf(attribute),
                                                     "; `weft export --help` has what each format carries"));
    }
  }
  return ExportTransform::Make(up.value_or(traits.up), world_up, unit.value_or(LengthUnit::kMetre)).status();
}

}  // namespace weft
