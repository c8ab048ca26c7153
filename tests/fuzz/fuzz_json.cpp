#include <cmath>

#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "weft/v1/board.pb.h"
#include "weft/v1/template.pb.h"

namespace {

// What is accepted can be written and is accepted again.
template <typename Message>
void Try(std::string_view text) {
  Message message;
  if (!weft::ParseJson(text, "json", message).ok()) return;
  const auto json = weft::ToJson(message);
  weft::FuzzRequire(json.ok());
  Message again;
  weft::FuzzRequire(weft::ParseJson(*json, "again", again).ok());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  Try<weft::v1::Board>(text);
  Try<weft::v1::Template>(text);
  const auto rig = weft::ParseRig(text, "rig.json");
  if (!rig.ok()) return 0;
  weft::FuzzRequire(rig->Validate().ok());
  for (const weft::CameraModel& camera : rig->cameras) weft::FuzzRequire(std::isfinite(camera.fx_px));
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {
      R"({"id": "studio", "cameras": [{"id": "a", "width_px": 100, "height_px": 80, "fx_px": 120.5, "fy_px": 121,
"cx_px": 50, "cy_px": 40, "distortion": [0.1, 0, 0, 0, 0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
"translation_mm": [0, 0.1, 1000]}]})",
      R"({"id": "board", "hash": "0123456789abcdef", "rows": 7, "cols": 9, "cell_mm": 2.7, "square_fraction": 0.75,
"image": "board.png"})",
      R"({"id": "shirt", "hash": "0123456789abcdef", "board_hash": "fedcba9876543210", "mesh": "mesh.ply",
"cells": "cells.txt"})"};
}
