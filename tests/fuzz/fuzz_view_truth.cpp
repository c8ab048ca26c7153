#include <cmath>

#include "services/synthetic/truth_file.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto truth = weft::ParseViewTruth({reinterpret_cast<const char*>(data), size}, "c", "truth");
  if (!truth.ok()) return 0;
  for (const weft::NodeTruth& n : truth->nodes) {
    weft::FuzzRequire(n.node.row >= 0 && n.node.col >= 0 && n.vertex >= -1);
    weft::FuzzRequire(n.pixel_px.allFinite() && std::isfinite(n.pitch_px) && std::isfinite(n.facing_deg));
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {
      "kind,row,col,x_px,y_px,pitch_px,facing_deg,visible,scoreable,vertex\n"
      "center,1,2,3.5,4.25,6.125,20.00,1,1,7\ncorner,0,0,-0.5,1e3,3,0,0,0,-1\n"};
}
