// Values of vertices painted on a garment, for pages and as files.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "services/results/report/mesh_colors.h"
#include "weft/v1/page.pb.h"

namespace weft {

struct GarmentMap {
  std::string title;           // "Vertex error"
  std::string label, unit;     // of the colour bar: "error", "mm"
  std::vector<double> values;  // [vertices], NaN is grey
  ScalarRange range;           // around 0 for differences
};
// Shares from 0 to 1 as per cent, 0 % to 100 %.
GarmentMap ShareMap(const std::string& title, const std::string& label, std::vector<double> shares);
// Both sides of the garment with a colour bar. Errors of RenderMesh.
absl::StatusOr<v1::PageMap> GarmentMapData(const TriangleMesh& mesh, const GarmentMap& map);
// The same as an SVG file.
absl::StatusOr<std::string> GarmentMapSvg(const TriangleMesh& mesh, const GarmentMap& map);

}  // namespace weft
