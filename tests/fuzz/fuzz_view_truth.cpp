#include <cmath>

#include "services/formats/synthetic/truth_file.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto truth = weft::DecodeViewTruth(bytes, "c", "truth");
  if (!truth.ok()) return 0;
  for (const weft::NodeTruth& n : truth->nodes) {
    weft::FuzzRequire(n.node.row >= 0 && n.node.col >= 0 && n.vertex >= -1);
    weft::FuzzRequire(n.pixel_px.allFinite() && std::isfinite(n.pitch_px) && std::isfinite(n.facing_deg));
  }
  weft::FuzzRequire(weft::EncodeViewTruth(*truth) == bytes);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  ViewTruth truth{"c", {}};
  NodeTruth center;
  center.node = {1, 2, NodeKind::kCenter};
  center.vertex = 7, center.pixel_px = {3.5, 4.25}, center.pitch_px = 6.125, center.facing_deg = 20;
  center.visible = center.scoreable = true;
  NodeTruth corner;
  corner.pixel_px = {-0.5, 1e3};
  truth.nodes = {center, corner};
  return {EncodeViewTruth(ViewTruth{"c", {}}), EncodeViewTruth(truth)};
}
