// For tests that need the program weft-pcl.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "services/formats/pcd/pcl_program.h"

#define WEFT_SKIP_WITHOUT_PCL() \
  if (const absl::Status pcl = weft::CheckPclProgram(); !pcl.ok()) GTEST_SKIP() << pcl.message()

namespace weft::testing {

// The head of a PCD file with these fields, of one number a point each.
inline std::string PcdHead(const std::string& fields, const std::string& sizes, const std::string& types,
                           const std::string& points, const std::string& data) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types + "\nWIDTH " +
         points + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA " + data + "\n";
}

}  // namespace weft::testing
