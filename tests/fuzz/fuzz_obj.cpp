// Wavefront OBJ: what is read is a mesh, whatever else the file says.
#include "services/formats/files/obj_file.h"
#include "services/formats/files/polygon_triangles.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

void CheckPolygons(std::string_view text) {
  const auto obj = weft::ParseObj(text, "obj");
  if (!obj.ok()) return weft::FuzzRequire(!obj.status().message().empty());
  for (const std::vector<weft::ObjCorner>& polygon : obj->polygons) {
    std::vector<Eigen::Vector3d> corners;
    for (const weft::ObjCorner& corner : polygon) {
      weft::FuzzRequire(corner.vertex >= 0 && corner.vertex < static_cast<int>(obj->vertices.size()));
      weft::FuzzRequire(corner.texture >= -1 && corner.texture < static_cast<int>(obj->texture.size()));
      corners.push_back(obj->vertices[static_cast<size_t>(corner.vertex)]);
    }
    const auto triangles = weft::TrianglesOfPolygon(corners);
    weft::FuzzRequire(triangles.size() + 2 == polygon.size());
    for (const auto& triangle : triangles)
      for (const int k : triangle) weft::FuzzRequire(k >= 0 && k < static_cast<int>(polygon.size()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  CheckPolygons({reinterpret_cast<const char*>(data), size});
  const auto mesh = weft::MeshFromObj({reinterpret_cast<const char*>(data), size}, "obj");
  if (!mesh.ok()) {
    weft::FuzzRequire(!mesh.status().message().empty());
    return 0;
  }
  weft::FuzzRequire(!mesh->vertices_mm.empty() && !mesh->faces.empty());
  weft::FuzzRequire(mesh->vertices_mm.size() <= size && mesh->faces.size() <= size);
  for (const Eigen::Vector3d& vertex : mesh->vertices_mm) weft::FuzzRequire(vertex.allFinite());
  for (const weft::Face& face : mesh->faces)
    for (const int v : face) weft::FuzzRequire(v >= 0 && v < static_cast<int>(mesh->vertices_mm.size()));
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {
      "# seed\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
      "mtllib cloth.mtl\no Cloth\nv 0 0 0 1 0.5 0.5\nv 1 0 0\nv 0 1e2 0\nv 1 1 -0.5\nvt 0 0\nvt 1 0\nvt 0 1\n"
      "vn 0 0 1\ng front\nusemtl print\ns 1\nf 1/1/1 2/2/1 3/3/1\ng back\nf 4//1 3//1 2//1\n",
      "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf -3 -2 -1\r\nl 1 2\r\np 3\r\n",
      "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nvt 0 0\nvt 1 0\nf 1/1 2/2 3/1 4/-1 5/-2\n",
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nt crease 1/0/1 1 2 0.5\nvw 0 0.5\n",
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nvw 0 1e46 0.5\r vw 0 1e46 0.5\nf 1 2 3\n",  // a joint beyond int
      "v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1\\\r\n 2 \\\n\\\n3\\",
  };
}
