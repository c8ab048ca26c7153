#include "services/formats/pcd/scan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/capture/temp_folder.h"
#include "tests/services/formats/pcd/with_pcl.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

std::string Head(const std::string& size, const std::string& points, const std::string& data) {
  return testing::PcdHead("x y z", size, "F F F", points, data);
}

template <typename T>
std::string Bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

absl::StatusOr<ScanFile> Read(const std::string& name, const std::string& content) {
  const TempFolder folder;
  WriteBytes(folder / name, content);
  return ReadScan(folder / name);
}

TEST(ReadScan, PcdAsTextFloatsOrDoublesHoldsTheSamePoints) {
  WEFT_SKIP_WITHOUT_PCL();
  for (const std::string& content : {Head("4 4 4", "2", "ascii") + "1 2.5 3\n-4 5 6\n",
                                     Head("4 4 4", "2", "binary") + Bytes<float>({1, 2.5, 3, -4, 5, 6}),
                                     Head("8 8 8", "2", "binary") + Bytes<double>({1, 2.5, 3, -4, 5, 6})}) {
    const auto scan = Read("scan.pcd", content);
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_THAT(scan->scan.points_mm, SizeIs(2));
    EXPECT_EQ(scan->scan.points_mm[0], Eigen::Vector3d(1, 2.5, 3));
    EXPECT_EQ(scan->scan.points_mm[1], Eigen::Vector3d(-4, 5, 6));
    EXPECT_TRUE(scan->scan.normals.empty());
  }
}

TEST(ReadScan, PointsWithoutMeasurementAreLeftOut) {
  WEFT_SKIP_WITHOUT_PCL();
  const auto scan = Read("scan.pcd", Head("4 4 4", "2", "ascii") + "nan nan nan\n1 2 3\n");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_THAT(scan->scan.points_mm, SizeIs(1));
}

std::string PlyScan(const std::vector<std::string>& rows, bool has_normals) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(rows.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\n";
  if (has_normals) text += "property float nx\nproperty float ny\nproperty float nz\n";
  text += "end_header\n";
  for (const std::string& row : rows) text += row + "\n";
  return text;
}

TEST(ReadScan, PlyPointsWithoutMeasurementAreLeftOutAndCounted) {
  const auto scan = Read("scan.ply", PlyScan({"nan nan nan", "1 2 3", "1 inf 3"}, false));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_THAT(scan->scan.points_mm, SizeIs(1));
  EXPECT_EQ(scan->points, 3);
  EXPECT_EQ(scan->unmeasured, 2);
  EXPECT_THAT(std::string(Read("scan.ply", PlyScan({"nan nan nan"}, false)).status().message()),
              HasSubstr("has no measured point"));
  EXPECT_THAT(std::string(Read("scan.ply", PlyScan({}, false)).status().message()),
              HasSubstr("has no measured point"));
}

TEST(ReadScan, OnePointWithoutANormalTakesNoOtherNormal) {
  for (const std::string missing : {"0 0 0", "nan nan nan", "0 0 inf"}) {
    const auto scan = Read("scan.ply", PlyScan({"1 2 3 0 0 4", "1 2 4 " + missing, "1 2 5 0 -2 0"}, true));
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_THAT(scan->scan.points_mm, SizeIs(2));
    ASSERT_THAT(scan->scan.normals, SizeIs(2));
    EXPECT_EQ(scan->scan.points_mm[1].z(), 5);
    EXPECT_EQ(scan->scan.normals[1], -Eigen::Vector3d::UnitY());
    EXPECT_EQ(scan->without_normal, 1);
  }
}

TEST(ReadScan, WhereMostNormalsAreMissingNoneAreUsed) {
  const auto scan = Read("scan.ply", PlyScan({"1 2 3 0 0 0", "1 2 4 0 0 1", "1 2 5 0 0 0"}, true));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_THAT(scan->scan.points_mm, SizeIs(3));
  EXPECT_THAT(scan->scan.normals, SizeIs(0));
  EXPECT_EQ(scan->without_normal, 2);
}

TEST(ReadScan, PlyNormalsHaveLengthOne) {
  const auto scan = Read("scan.ply",
                         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                         "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                         "end_header\n1 2 3 0 0 4\n");
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_THAT(scan->scan.normals, SizeIs(1));
  EXPECT_EQ(scan->scan.normals[0], Eigen::Vector3d::UnitZ());
}

TEST(ReadScan, PcdNormalsOfAnyLengthGetLengthOne) {
  WEFT_SKIP_WITHOUT_PCL();
  for (const std::string normal : {"0 0 4", "0 0 1e-200", "0 0 1e200"}) {
    const auto scan = Read("scan.pcd", testing::PcdHead("x y z normal_x normal_y normal_z", "8 8 8 8 8 8",
                                                        "F F F F F F", "1", "ascii") +
                                           "1 2 3 " + normal + "\n");
    ASSERT_TRUE(scan.ok()) << scan.status();
    ASSERT_THAT(scan->scan.normals, SizeIs(1)) << normal;
    EXPECT_EQ(scan->scan.normals[0], Eigen::Vector3d::UnitZ());
  }
}

TEST(ReadScan, NamesTheFile) {
  EXPECT_THAT(std::string(Read("scan.pcd", "no header").status().message()),
              HasSubstr("scan.pcd: is no PCD file"));
  EXPECT_EQ(ReadScan("/no/such.pcd").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
