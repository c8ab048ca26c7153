// Pictures of meshes, and what their colours mean, as pages' data.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "services/results/report/html_report.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/picture_html.h"
#include "weft/v1/page.pb.h"

namespace weft {

v1::PagePicture PictureData(const MeshPicture& picture);
void AddPictures(const std::vector<MeshPicture>& pictures,
                 google::protobuf::RepeatedPtrField<v1::PagePicture>& data);

// `bounded`: no value exceeds the range. A range around 0 has the diverging colours.
v1::PageKey ScaleKey(const ScalarRange& range, const std::string& label, const std::string& unit,
                     bool bounded = false);
// What the colours of states mean.
v1::PageKey StateKey(const std::vector<VertexState>& states);

// Both sides of the garment with values painted on it. Errors of RenderMesh.
absl::StatusOr<v1::PageMap> GarmentMapData(const TriangleMesh& mesh, const GarmentMap& map);

}  // namespace weft
