#include "alignment/template.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto cells =
      weft::ParseVertexMap({reinterpret_cast<const char*>(data), size}, weft::NodeKind::kCenter, "cells");
  if (!cells.ok()) return 0;
  for (const weft::VertexNode& cell : *cells) {
    weft::FuzzRequire((cell.row == -1 && cell.col == -1) || (cell.row >= 0 && cell.col >= 0));
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() { return {"0 0\n0 1\n10 20\n-1 -1\n299 899\n"}; }
