// Pictures of meshes, and what their colours mean, as pages' data.
#pragma once

#include <string>
#include <vector>

#include "alignment/mesh.h"
#include "services/results/report/job_report.h"
#include "services/results/report/mesh_colors.h"
#include "weft/v1/page.pb.h"

namespace weft {

v1::PagePicture PictureData(const MeshPicture& picture);
void AddPictures(const std::vector<MeshPicture>& pictures,
                 google::protobuf::RepeatedPtrField<v1::PagePicture>& data);

// Of a colour scale at equal distances, from low to high: "#rrggbb".
std::vector<std::string> ScaleColors(const ScalarRange& range);
// `bounded`: no value exceeds the range. A range around 0 has the diverging colours.
v1::PageKey ScaleKey(const ScalarRange& range, const std::string& label, const std::string& unit,
                     bool bounded = false);
// What the colours of states mean.
v1::PageKey StateKey(const std::vector<VertexState>& states);

}  // namespace weft
