#include "services/formats/files/listed_file.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

// Of no bytes and of "a", as the reference implementation's `xxhsum -H3` prints them.
TEST(ListedFile, HasTheChecksumOfXxh3) {
  EXPECT_EQ(ListedChecksum(""), "2d06800538d394c2");
  EXPECT_EQ(ListedChecksum("a"), "e6c632b61e964e1f");
}

TEST(ListedFile, IsCheckedBySizeAndChecksum) {
  v1::FrameReport report;
  EXPECT_TRUE(CheckListed(report, "mesh.ply", "a", "r/mesh.ply").ok()) << "of an earlier version";
  v1::ResultFile& file = *report.add_files();
  file.set_name("mesh.ply");
  file.set_bytes(1);
  file.set_checksum("e6c632b61e964e1f");
  EXPECT_EQ(FindListed(report, "mesh.ply"), &report.files(0));
  EXPECT_EQ(FindListed(report, "mesh"), nullptr);
  EXPECT_TRUE(CheckListed(report, "mesh.ply", "a", "r/mesh.ply").ok());
  EXPECT_TRUE(CheckListed(report, "cloud.ply", "b", "r/cloud.ply").ok());
  EXPECT_EQ(
      CheckListed(report, "mesh.ply", "b", "r/mesh.ply"),
      absl::DataLossError("r/mesh.ply: is not as report.json lists it; `weft register` with the same inputs "
                          "computes the frame again"));
  file.set_bytes(2);
  EXPECT_FALSE(CheckListed(report, "mesh.ply", "a", "r/mesh.ply").ok());
}

}  // namespace
}  // namespace weft
