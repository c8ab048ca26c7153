// A job's mesh.ply, as pages get it.
#include "services/formats/files/ply.h"
#include "services/server/console/quantized_mesh.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view ply(reinterpret_cast<const char*>(data), size);
  const auto end = weft::EndOfVertices(ply, "mesh");
  for (const bool with_faces : {false, true}) {
    const auto mesh = weft::QuantizedMesh(ply, with_faces, "mesh");
    if (!mesh.ok()) continue;
    weft::FuzzRequire(end.ok() && end->has_value() && **end <= size);
    weft::FuzzRequire(mesh->substr(0, 8) == "weftmsh1" && mesh->size() > 80);
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  Ply ply;
  PlyElement vertex{"vertex", 3, {}};
  for (const char* axis : {"x", "y", "z"})
    vertex.properties.push_back(PlyColumn(axis, PlyType::kFloat32, {0, 1, 2}));
  vertex.properties.push_back(PlyColumn("state", PlyType::kUint8, {0, 1, 3}));
  vertex.properties.push_back(PlyColumn("sigma_mm", PlyType::kFloat32, {0.1, 0.2, 3}));
  vertex.properties.push_back(PlyColumn("views", PlyType::kInt32, {0, 4, 70}));
  ply.elements.push_back(vertex);
  PlyProperty corners = PlyColumn("vertex_indices", PlyType::kInt32, {0, 1, 2});
  corners.is_list = true;
  corners.list_start = {0, 3};
  ply.elements.push_back({"face", 1, {corners}});
  const auto bytes = SerializePly(ply);
  FuzzRequire(bytes.ok());
  return {*bytes};
}
