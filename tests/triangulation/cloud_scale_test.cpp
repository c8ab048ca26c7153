#include "triangulation/cloud_scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

// Distances between neighbours that are 12 % noise would be 3 % too long.
TEST(CloudScale, NoiseDoesNotStretch) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 0.3);
  Cloud cloud = Sheet(40, 40, 2.5, 2.5);
  for (CloudPoint& point : cloud.points)
    for (double& coordinate : point.position_mm) coordinate += noise(random);
  EXPECT_NEAR(MeasureCloudScale(cloud, OfPrint).value(), 1, 0.01);
}

// Around a fold of 5 mm, chords of cells are 1 % shorter than the cloth along it.
TEST(CloudScale, BendsShortenByTheirChordsAlone) {
  Cloud cloud = Sheet(40, 40, 2.5, 2.5);
  constexpr double kRadius_mm = 5;
  for (CloudPoint& point : cloud.points) {
    const double angle = point.position_mm.x() / kRadius_mm;
    point.position_mm.x() = kRadius_mm * std::sin(angle),
    point.position_mm.z() = kRadius_mm * std::cos(angle);
  }
  const double chord = 2 * kRadius_mm * std::sin(1.25 / kRadius_mm) / 2.5;
  EXPECT_NEAR(MeasureCloudScale(cloud, OfPrint).value(), std::sqrt(chord), 1e-9);
}

TEST(CloudScale, FewCellsOrAnUnknownPrintTellNothing) {
  EXPECT_FALSE(MeasureCloudScale(Sheet(5, 5, 2.5, 2.5), OfPrint).has_value());
  EXPECT_FALSE(MeasureCloudScale(Sheet(40, 40, 2.5, 2.5), [](const BoardNode&, const BoardNode&) {
                 return std::optional<double>();
               }).has_value());
}

}  // namespace
}  // namespace weft
