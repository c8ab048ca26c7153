// The folder of a template: template.json, mesh.ply, cells.txt and corners.txt in one input (many_files.h).
#include <regex>

#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/template_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/many_files.h"

namespace {

const std::filesystem::path& Folder() {
  static const std::filesystem::path folder = weft::FuzzFolder("template");
  return folder;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  weft::fuzz_end = [] { std::filesystem::remove_all(Folder()); };
  weft::WriteFiles(weft::SplitFiles({reinterpret_cast<const char*>(data), size}), Folder());
  (void)weft::ReadGarmentParts(Folder());
  const auto garment = weft::ReadTemplate(Folder());
  if (!garment.ok()) {
    weft::FuzzRequire(!garment.status().message().empty());
    return 0;
  }
  // What is accepted can be used: every index is one of the mesh, and it is written and read as the same.
  weft::FuzzRequire(garment->node_of_vertex.size() == garment->rest.vertices_mm.size());
  const auto vertices = static_cast<int>(garment->rest.vertices_mm.size());
  for (const auto& face : garment->rest.faces)
    for (const int vertex : face) weft::FuzzRequire(vertex >= 0 && vertex < vertices);
  const std::string again_folder = Folder() / "again";
  weft::FuzzRequire(weft::WriteTemplate(again_folder, *garment, "").ok());
  const auto again = weft::ReadTemplate(again_folder);
  weft::FuzzRequire(again.ok() && again->ContentHash() == garment->ContentHash());
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const auto board = GenerateBoard(6, 6, 2.7, 1);
  const TriangleMesh mesh{{{0, 0, 0.1}, {2.7, 0, 0}, {0, 2.7, 0}, {2.7, 1.0 / 3, 0}}, {{0, 2, 1}, {2, 3, 1}}};
  const auto garment = ImportTemplate("shirt", mesh, {{0, 0}, {0, 1}, {1, 0}, {-1, -1}}, *board);
  FuzzRequire(garment.ok() && WriteTemplate(Folder(), *garment, "by hand").ok());
  std::map<std::string, std::string> files = ReadFiles(Folder());
  std::filesystem::remove_all(Folder());
  const std::string whole = JoinFiles(files);
  // Without its hash, so that other files belong together, too.
  std::string& json = files["template.json"];
  json = std::regex_replace(json, std::regex("\"(hash|board_hash)\": *\"[0-9a-f]*\",?"), "");
  const std::string open = JoinFiles(files);
  files["mesh.ply"] =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2.7 0 0\n0 2.7 0\n3 0 2 "
      "1\n";
  files["cells.txt"] = "0 0\n0 1\n1 0\n";
  return {whole, open, JoinFiles(files)};
}
