#include "services/results/evaluation/garment_maps.h"

#include "absl/strings/str_cat.h"

namespace weft {

void AddGarmentMap(const TriangleMesh& shape, const GarmentMap& map, v1::PageMaps& maps) {
  if (shape.vertices_mm.empty() || map.values.empty()) return;
  absl::StatusOr<v1::PageMap> drawn = GarmentMapData(shape, map);
  if (drawn.ok()) {
    *maps.add_maps() = *std::move(drawn);
  } else {
    maps.add_problems(absl::StrCat(map.title, " has no picture: ", drawn.status().message()));
  }
}

}  // namespace weft
