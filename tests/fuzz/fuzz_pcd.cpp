#include <cmath>

#include "services/files/scan_file.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto scan = weft::ParsePcd({reinterpret_cast<const char*>(data), size}, "pcd");
  if (!scan.ok()) return 0;
  // No more than the file has bytes for, and nothing that the alignment could not bear.
  weft::FuzzRequire(scan->points_mm.size() <= size);
  for (const Eigen::Vector3d& p : scan->points_mm) weft::FuzzRequire(p.allFinite());
  weft::FuzzRequire(scan->normals.empty() || scan->normals.size() == scan->points_mm.size());
  for (const Eigen::Vector3d& n : scan->normals) weft::FuzzRequire(std::abs(n.norm() - 1) < 1e-9);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const std::string text =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z normal_x normal_y normal_z rgb\nSIZE 4 4 4 4 4 4 4\n"
      "TYPE F F F F F F U\nCOUNT 1 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n"
      "DATA ascii\n1 2.5 -3 0 0 1 7\nnan nan nan 0 1 0 7\n";
  const std::vector<double> values = {1, 2.5, -3, 4, 5, 6e-200};
  const std::string binary = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nPOINTS 2\nDATA binary\n" +
                             std::string(reinterpret_cast<const char*>(values.data()), 48);
  const std::string padded =
      "FIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4\nPOINTS 1\nDATA binary\n" +
      std::string(16, '\1');
  return {text, binary, padded};
}
