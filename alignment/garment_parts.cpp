#include "alignment/garment_parts.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

absl::Status CheckIndices(const std::vector<int>& indices, size_t count, const std::string& whose,
                          const char* what) {
  for (const int index : indices) {
    if (index >= 0 && static_cast<size_t>(index) < count) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(whose, " names ", what, " ", index, ", there are ", count));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckGarmentParts(const GarmentParts& parts, const TriangleMesh& mesh) {
  const size_t vertices = mesh.vertices_mm.size(), panels = parts.panels.size();
  for (size_t i = 0; i < parts.seams.size(); ++i) {
    const Seam& seam = parts.seams[i];
    const std::string whose = absl::StrCat("seam ", i);
    absl::Status status = CheckIndices(seam.side_a, vertices, whose, "vertex");
    status.Update(CheckIndices(seam.side_b, vertices, whose, "vertex"));
    status.Update(CheckIndices(seam.middle, vertices, whose, "vertex"));
    status.Update(CheckIndices({seam.panel_a, seam.panel_b}, panels, whose, "panel"));
    if (!status.ok()) return status;
  }
  for (size_t i = 0; i < parts.openings.size(); ++i) {
    const TemplateBorder& border = parts.openings[i];
    const std::string whose = absl::StrCat("opening ", i);
    absl::Status status = CheckIndices(border.loop, vertices, whose, "vertex");
    status.Update(CheckIndices(border.panels, panels, whose, "panel"));
    if (!status.ok()) return status;
  }
  if (parts.panel_faces < 0 || static_cast<size_t>(parts.panel_faces) > mesh.faces.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("panel_faces is ", parts.panel_faces, ", the mesh has ", mesh.faces.size(), " faces"));
  }
  if (parts.texture_mm.empty()) return absl::OkStatus();
  if (parts.texture_mm.size() != vertices || !(parts.texture_side_mm > 0)) {
    return absl::InvalidArgumentError("texture coordinates need texture_side_mm and one for each vertex");
  }
  for (size_t v = 0; v < vertices; ++v) {
    const Eigen::Vector2d& place = parts.texture_mm[v];
    if (place.minCoeff() >= 0 && place.maxCoeff() <= parts.texture_side_mm) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("vertex ", v, ": its texture coordinates lie outside the square"));
  }
  return absl::OkStatus();
}

}  // namespace weft
