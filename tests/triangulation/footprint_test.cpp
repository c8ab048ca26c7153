#include "triangulation/footprint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <functional>
#include <random>

namespace weft {
namespace {

constexpr int kRows = 30, kCols = 40;
constexpr double kCellMm = 2.7;

// Cloth rolled about a slanted axis, by row and column (corners at halves).
Eigen::Vector3d Thread(double row, double col, double radius_mm) {
  const double along = kCellMm * (0.8 * col + 0.6 * row), across = kCellMm * (0.8 * row - 0.6 * col);
  return {radius_mm * std::sin(along / radius_mm), across, radius_mm * (1 - std::cos(along / radius_mm))};
}

// What a decoder measures: centres average their neighbours, corners lie between four centres.
Cloud Measured(double radius_mm, double sigma_mm, uint32_t seed, const FootprintOptions& options) {
  const auto at = [&](int r, int c) { return Thread(r, c, radius_mm); };
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma_mm);
  Cloud cloud;
  const auto add = [&](BoardNode node, const Eigen::Vector3d& position) {
    const Eigen::Vector3d error(noise(random), noise(random), noise(random));
    cloud.points.push_back({.position_mm = position + error,
                            .node = node,
                            .views = 5,
                            .sigma_mm = sigma_mm,
                            .covariance_mm2 = sigma_mm * sigma_mm * Eigen::Matrix3d::Identity()});
  };
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kCols; ++c) {
      const Eigen::Vector3d around = (at(r - 1, c) + at(r + 1, c) + at(r, c - 1) + at(r, c + 1)) / 4;
      const double share = options.neighbor_share;
      add({r, c, NodeKind::kCenter}, (1 - share) * at(r, c) + share * around);
    }
  }
  for (int r = 1; r < kRows; ++r) {
    for (int c = 1; c < kCols; ++c) {
      add({r, c, NodeKind::kCorner}, (at(r, c) + at(r - 1, c) + at(r, c - 1) + at(r - 1, c - 1)) / 4);
    }
  }
  return cloud;
}

double RmsOfCenters(const Cloud& cloud, double radius_mm,
                    const std::function<bool(const BoardNode&)>& counts) {
  double sum = 0;
  int count = 0;
  for (const CloudPoint& p : cloud.points) {
    if (p.node.kind != NodeKind::kCenter || !counts(p.node)) continue;
    sum += (p.position_mm - Thread(p.node.row, p.node.col, radius_mm)).squaredNorm();
    ++count;
  }
  return std::sqrt(sum / count);
}

bool Inside(const BoardNode& n) { return n.row > 0 && n.col > 0 && n.row < kRows - 1 && n.col < kCols - 1; }

constexpr FootprintOptions kBlunt{.neighbor_share = 0.43};

TEST(SharpenCenters, PutsCentresOfBentClothWhereTheirThreadsAre) {
  const Cloud measured = Measured(8, 0, 1, kBlunt);
  const double before = RmsOfCenters(measured, 8, Inside);
  EXPECT_GT(before, 0.05);
  EXPECT_LT(RmsOfCenters(SharpenCenters(measured, kBlunt), 8, Inside), 0.1 * before);
}

TEST(SharpenCenters, TellsTheBendByNeighboursWhereCornersAreMissing) {
  Cloud measured = Measured(8, 0, 1, kBlunt);
  std::erase_if(measured.points, [](const CloudPoint& p) { return p.node.kind == NodeKind::kCorner; });
  const double before = RmsOfCenters(measured, 8, Inside);
  EXPECT_LT(RmsOfCenters(SharpenCenters(measured, kBlunt), 8, Inside), 0.25 * before);
}

TEST(SharpenCenters, LeavesFlatClothWhereItIs) {
  const Cloud measured = Measured(1e9, 0, 1, {}), sharp = SharpenCenters(measured, {});
  for (size_t i = 0; i < measured.points.size(); ++i) {
    EXPECT_LT((sharp.points[i].position_mm - measured.points[i].position_mm).norm(), 1e-5);
    EXPECT_EQ(sharp.points[i].node, measured.points[i].node);
  }
}

// On cloth that bends mildly the noise of the rays is all there is.
TEST(SharpenCenters, CovarianceMatchesTheErrors) {
  const double radius_mm = 300;
  FootprintOptions options;
  options.shared_edges = options.fold_error = 0;
  const Cloud sharp = SharpenCenters(Measured(radius_mm, 0.03, 2, options), options);
  double chi_square = 0;
  int count = 0;
  for (const CloudPoint& p : sharp.points) {
    if (p.node.kind != NodeKind::kCenter || !Inside(p.node)) continue;
    const Eigen::Vector3d error = p.position_mm - Thread(p.node.row, p.node.col, radius_mm);
    chi_square += error.dot(p.covariance_mm2.inverse() * error) / 3;
    EXPECT_NEAR(p.sigma_mm, std::sqrt(p.covariance_mm2.trace() / 3), 1e-12);
    ++count;
  }
  EXPECT_NEAR(chi_square / count, 1, 0.2);
}

TEST(SharpenCenters, IsLessSureOfCentresThatNothingSurrounds) {
  const Cloud sharp = SharpenCenters(Measured(30, 0.01, 3, {}), {});
  double inside = 0, corner = 0;
  for (const CloudPoint& p : sharp.points) {
    if (p.node == BoardNode{5, 5, NodeKind::kCenter}) inside = p.sigma_mm;
    if (p.node == BoardNode{0, 0, NodeKind::kCenter}) corner = p.sigma_mm;
  }
  EXPECT_GT(corner, 2 * inside);
}

TEST(SharpenCenters, IsLessSureInNarrowFoldsAndBesideThem) {
  Cloud measured = Measured(1e9, 0, 1, {});
  for (CloudPoint& p : measured.points) {
    if (p.node.kind == NodeKind::kCenter && p.node.row == 5) p.position_mm.z() += 1;
  }
  const Cloud sharp = SharpenCenters(measured, {});
  std::array<double, kRows> sigma_mm = {};
  for (const CloudPoint& p : sharp.points) {
    if (p.node.kind != NodeKind::kCenter || p.node.col != 5) continue;
    sigma_mm[p.node.row] = p.sigma_mm;
    // In the direction in which the fold stands out only.
    EXPECT_LT(p.covariance_mm2(0, 0), 0.03 * 0.03);
  }
  EXPECT_GT(sigma_mm[5], 0.05);
  EXPECT_GT(sigma_mm[4], 0.05);
  EXPECT_LT(sigma_mm[8], 0.03);
}

TEST(SharpenCenters, ChangesNothingWithoutAnAverage) {
  const Cloud measured = Measured(8, 0.02, 4, {});
  const Cloud same = SharpenCenters(measured, {.neighbor_share = 0});
  for (size_t i = 0; i < measured.points.size(); ++i) {
    EXPECT_EQ(same.points[i].position_mm, measured.points[i].position_mm);
  }
  EXPECT_TRUE(SharpenCenters({}, {}).points.empty());
}

TEST(FootprintOptions, NamesTheFieldThatIsWrong) {
  FootprintOptions options;
  options.neighbor_share = 1;
  EXPECT_THAT(options.Validate().message(), ::testing::HasSubstr("footprint.neighbor_share"));
}

}  // namespace
}  // namespace weft
