// Uploads by kind: a line with the kind, then the files (many_files.h), as the library checks them.
#include "capture/image/image_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/template_file.h"
#include "services/work/items/check_item.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/many_files.h"

namespace {

const std::filesystem::path& Folder() {
  static const std::filesystem::path folder = weft::FuzzFolder("item");
  return folder;
}

std::string Item(weft::v1::ItemKind kind, const std::map<std::string, std::string>& files) {
  return std::to_string(kind) + "\n" + weft::JoinFiles(files);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  weft::fuzz_end = [] { std::filesystem::remove_all(Folder()); };
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const size_t line_end = bytes.find('\n');
  if (line_end != 1 || !weft::v1::ItemKind_IsValid(bytes[0] - '0')) return 0;
  const std::map<std::string, std::string> files = weft::SplitFiles(bytes.substr(2));
  weft::WriteFiles(files, Folder());
  weft::v1::ItemManifest manifest;
  for (const auto& entry : std::filesystem::directory_iterator(Folder())) {
    weft::v1::ItemFile& file = *manifest.add_files();
    file.set_path(entry.path().filename());
    file.set_bytes(static_cast<int64_t>(entry.file_size()));
  }
  const absl::Status status =
      weft::CheckItemContent(static_cast<weft::v1::ItemKind>(bytes[0] - '0'), manifest, Folder());
  // Whoever uploaded it knows nothing of the daemon's folders.
  weft::FuzzRequire(status.ok() || absl::IsInvalidArgument(status), std::string(status.message()));
  weft::FuzzRequire(status.message().find(Folder().string()) == std::string::npos,
                    std::string(status.message()));
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const auto board = GenerateBoard(6, 6, 2.7, 1);
  FuzzRequire(WriteBoard(Folder(), *board, "").ok());
  const auto board_files = ReadFiles(Folder());
  std::filesystem::remove_all(Folder());
  const TriangleMesh mesh{{{0, 0, 0.1}, {2.7, 0, 0}, {0, 2.7, 0}}, {{0, 2, 1}}};
  const auto garment = ImportTemplate("shirt", mesh, {{0, 0}, {0, 1}, {1, 0}}, *board);
  FuzzRequire(garment.ok() && WriteTemplate(Folder(), *garment, "").ok());
  const auto template_files = ReadFiles(Folder());
  std::filesystem::remove_all(Folder());
  return {Item(v1::ITEM_KIND_BOARD, board_files),
          Item(v1::ITEM_KIND_BOARD, {{"board.png", board_files.at("board.png")}}),
          Item(v1::ITEM_KIND_TEMPLATE, template_files),
          Item(v1::ITEM_KIND_RIG,
               {{"rig.json", R"({"cameras": [{"id": "a", "width_px": 100, "height_px": 80, "fx_px": 120.5,
"fy_px": 121, "cx_px": 50, "cy_px": 40, "distortion": [0.1, 0, 0, 0, 0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
"translation_mm": [0, 0.1, 1000]}]})"}}),
          Item(v1::ITEM_KIND_DUMP, {{"take.json", "{}"}, {"0001_a.png", board_files.at("board.png")}}),
          Item(v1::ITEM_KIND_AVATAR, {{"avatar.json", "{}"}, {"space.bin", "x"}})};
}
