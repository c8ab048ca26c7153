#include <cmath>

#include "services/formats/files/mesh_file.h"
#include "services/formats/files/ply.h"
#include "services/formats/files/ply_points.h"
#include "services/formats/pcd/scan_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

// Of a scan all that is left has a place, and a normal of length 1 where there are normals.
void TryScan(const weft::Ply& ply) {
  weft::Points points{ply};
  const weft::PlyElement* vertex = ply.Find("vertex");
  const size_t rows = vertex == nullptr ? 0 : vertex->rows;
  points.unmeasured = weft::DropUnmeasured(points.ply);
  weft::FuzzRequire(weft::SerializePly(points.ply).ok());
  const auto scan = weft::ScanFromPoints(points, "scan");
  if (!scan.ok()) return;
  weft::FuzzRequire(scan->points == static_cast<int>(rows) && !scan->scan.points_mm.empty());
  weft::FuzzRequire(scan->scan.normals.empty() || scan->scan.normals.size() == scan->scan.points_mm.size());
  for (const Eigen::Vector3d& p : scan->scan.points_mm) weft::FuzzRequire(p.allFinite());
  for (const Eigen::Vector3d& n : scan->scan.normals) weft::FuzzRequire(std::abs(n.norm() - 1) < 1e-9);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto ply = weft::ParsePly({reinterpret_cast<const char*>(data), size}, "ply");
  if (!ply.ok()) return 0;
  size_t values = 0;
  for (const weft::PlyElement& element : ply->elements) {
    for (const weft::PlyProperty& property : element.properties) {
      weft::FuzzRequire(property.is_list ? property.list_start.size() == element.rows + 1
                                         : property.values.size() == element.rows);
      values += property.values.size();
    }
  }
  weft::FuzzRequire(values <= size);
  // What was read can be written, and reads back as large. Lists of more than their type counts cannot occur.
  const auto bytes = weft::SerializePly(*ply);
  weft::FuzzRequire(bytes.ok());
  weft::FuzzRequire(weft::ParsePly(*bytes, "again").ok());
  TryScan(*ply);
  const auto mesh = weft::MeshFromPly(*ply, "ply");
  if (!mesh.ok()) return 0;
  for (const weft::Face& face : mesh->faces) {
    for (const int v : face) weft::FuzzRequire(v >= 0 && v < static_cast<int>(mesh->vertices_mm.size()));
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const std::string elements =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  Ply ply;
  PlyElement vertex{"vertex", 3, {}};
  for (const char* axis : {"x", "y", "z"})
    vertex.properties.push_back(PlyColumn(axis, PlyType::kFloat64, {0, 1, 2}));
  ply.elements.push_back(vertex);
  const auto binary = SerializePly(ply);
  FuzzRequire(binary.ok());
  const std::string big = "ply\nformat binary_big_endian 1.0\n" + elements + std::string(36, '\1') + "\3" +
                          std::string({0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2});
  return {
      "ply\nformat ascii 1.0\ncomment seed\n" + elements + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", *binary, big,
      "ply\rformat ascii 1.0\relement\tvertex 2 \rproperty float x\rproperty float y\rproperty float z\r"
      "property float nx\rproperty float ny\rproperty float nz\rend_header\r0 0 0 0 0 2\rnan 0 0 0 0 0\r"};
}
