// Pictures of meshes as HTML.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "services/results/report/html_report.h"
#include "services/results/report/mesh_colors.h"

namespace weft {

// "label 0 mm [colours] 0.5 mm and more"; `bounded`: no value exceeds the range. A range around 0 has the
// diverging colours.
std::string ColorBar(const ScalarRange& range, const std::string& label, const std::string& unit,
                     bool bounded = false);
// What the colours of states mean.
std::string StateLegend(const std::vector<VertexState>& states);
// Pictures side by side under their legend (HTML already); empty without pictures.
std::string PictureRow(const std::vector<MeshPicture>& pictures, const std::string& what_of,
                       const std::string& coloring, const std::string& legend);

// Values of the vertices to be painted on a garment.
struct GarmentMap {
  std::string title;           // "Vertex error"
  std::string label, unit;     // of the colour bar: "error", "mm"
  std::vector<double> values;  // [vertices], NaN is grey
  ScalarRange range;           // around 0 for differences
};
// Shares from 0 to 1 as per cent, 0 % to 100 %.
GarmentMap ShareMap(const std::string& title, const std::string& label, std::vector<double> shares);
// Both sides of the garment with a heading and a colour bar. Errors of RenderMesh.
absl::StatusOr<std::string> GarmentMapHtml(const TriangleMesh& mesh, const GarmentMap& map);
// The same as an SVG file.
absl::StatusOr<std::string> GarmentMapSvg(const TriangleMesh& mesh, const GarmentMap& map);

}  // namespace weft
