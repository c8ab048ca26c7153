#include "triangulation/cloud_scale.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

Cloud Sheet(int rows, int cols, double along_mm, double down_mm) {
  Cloud cloud;
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols; ++col) {
      CloudPoint& point = cloud.points.emplace_back();
      point.node = {row, col, NodeKind::kCenter};
      point.position_mm = {along_mm * col, down_mm * row, 0};
    }
  return cloud;
}

std::optional<double> OfPrint(const BoardNode&, const BoardNode&) { return 2.5; }

TEST(CloudScale, IsThatOfThePrint) {
  EXPECT_NEAR(MeasureCloudScale(Sheet(40, 40, 2.5, 2.5), OfPrint).value(), 1, 1e-12);
  EXPECT_NEAR(MeasureCloudScale(Sheet(40, 40, 2.625, 2.625), OfPrint).value(), 1.05, 1e-12);
}

// Cloth that is drawn along its columns by 10 % and narrows by as much has the size of its print.
TEST(CloudScale, DrawnClothKeepsItsSize) {
  EXPECT_NEAR(MeasureCloudScale(Sheet(40, 40, 2.5 * 1.1, 2.5 / 1.1), OfPrint).value(), 1, 1e-12);
}

TEST(CloudScale, WrongCellsChangeNothing) {
  Cloud cloud = Sheet(40, 40, 2.5, 2.5);
  for (size_t i = 0; i < cloud.points.size(); i += 10) cloud.points[i].position_mm.z() = 500;
  EXPECT_NEAR(MeasureCloudScale(cloud, OfPrint).value(), 1, 1e-12);
}

TEST(CloudScale, FewCellsOrAnUnknownPrintTellNothing) {
  EXPECT_FALSE(MeasureCloudScale(Sheet(5, 5, 2.5, 2.5), OfPrint).has_value());
  EXPECT_FALSE(MeasureCloudScale(Sheet(40, 40, 2.5, 2.5), [](const BoardNode&, const BoardNode&) {
                 return std::optional<double>();
               }).has_value());
}

}  // namespace
}  // namespace weft
