#include "triangulation/clean.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/triangulation/synthetic_views.h"

namespace weft {
namespace {

using testing::BentSheet;
using testing::NodeTruth;

Cloud CloudOf(const std::vector<NodeTruth>& nodes) {
  Cloud cloud;
  for (const NodeTruth& n : nodes) cloud.points.push_back({n.position_mm, n.node, 5, 0.1});
  return cloud;
}

CloudPoint& PointAt(Cloud* cloud, int row, int col) {
  return *std::find_if(cloud->points.begin(), cloud->points.end(),
                       [&](const CloudPoint& p) { return p.node.row == row && p.node.col == col; });
}

void KeepNodes(Cloud* cloud, const std::function<bool(int row, int col)>& keep) {
  std::erase_if(cloud->points, [&](const CloudPoint& p) { return !keep(p.node.row, p.node.col); });
}

TEST(CleanCloud, LeavesGoodClothAlone) {
  const Cloud cloud = CloudOf(BentSheet(30, 40));
  const Cloud clean = CleanCloud(cloud, {});
  EXPECT_EQ(clean.points.size(), 1200u);
  EXPECT_TRUE(clean.rejected.empty());
}

TEST(CleanCloud, RejectsThePointThatLiesElsewhereAndKeepsItsNeighbours) {
  Cloud cloud = CloudOf(BentSheet(30, 40));
  PointAt(&cloud, 12, 17).position_mm += Eigen::Vector3d(60, 0, 0);
  const Cloud clean = CleanCloud(cloud, {});
  EXPECT_EQ(clean.points.size(), 1199u);
  ASSERT_EQ(clean.rejected.size(), 1u);
  EXPECT_EQ(clean.rejected[0].node, (BoardNode{12, 17, NodeKind::kCenter}));
  EXPECT_EQ(clean.rejected[0].reason, RejectReason::kIsolated);
  EXPECT_EQ(clean.rejected[0].views, 5);
}

// Near the cloth in space, but not near the cells that it should lie beside.
TEST(CleanCloud, RejectsThePointWithAWrongPlaceOnTheBoard) {
  Cloud cloud = CloudOf(BentSheet(30, 40));
  PointAt(&cloud, 12, 17).position_mm = PointAt(&cloud, 12, 30).position_mm;
  const Cloud clean = CleanCloud(cloud, {});
  ASSERT_EQ(clean.rejected.size(), 1u);
  EXPECT_EQ(clean.rejected[0].node, (BoardNode{12, 17, NodeKind::kCenter}));
}

TEST(CleanCloud, RejectsStretchedEdgesOfTwoBadPointsOnly) {
  Cloud cloud = CloudOf(BentSheet(30, 40));
  CleaningOptions options;
  options.min_neighbors = 0;
  options.min_near_share = 0;
  PointAt(&cloud, 12, 17).position_mm += Eigen::Vector3d(0, 0, 25);
  PointAt(&cloud, 13, 18).position_mm += Eigen::Vector3d(0, 0, -25);  // shares two neighbours with the first
  const Cloud clean = CleanCloud(cloud, options);
  ASSERT_EQ(clean.rejected.size(), 2u);
  EXPECT_EQ(clean.rejected[0].node, (BoardNode{12, 17, NodeKind::kCenter}));
  EXPECT_EQ(clean.rejected[1].node, (BoardNode{13, 18, NodeKind::kCenter}));
  EXPECT_EQ(clean.rejected[0].reason, RejectReason::kStretchedEdges);
}

TEST(CleanCloud, RejectsPointsWithFewNeighbours) {
  Cloud cloud = CloudOf(BentSheet(30, 40));
  KeepNodes(&cloud, [](int row, int col) { return row < 20 || (row == 26 && col >= 3 && col < 6); });
  const Cloud clean = CleanCloud(cloud, {});
  EXPECT_EQ(clean.points.size(), 800u);
  ASSERT_EQ(clean.rejected.size(), 3u);
  for (const RejectedNode& r : clean.rejected) EXPECT_EQ(r.reason, RejectReason::kIsolated);
}

// Three cells of ten found, at random: all of them are good.
TEST(CleanCloud, KeepsNearlyAllOfSparselySeenCloth) {
  Cloud cloud = CloudOf(BentSheet(60, 60));
  std::mt19937 random(4);
  KeepNodes(&cloud, [&](int, int) { return random() % 10 < 3; });
  const size_t seen = cloud.points.size();
  EXPECT_GT(CleanCloud(cloud, {}).points.size(), 0.99 * seen);
}

class Island : public ::testing::TestWithParam<int> {
 protected:
  // Twenty cells (four rows, five columns) `gap` rows below the others.
  Cloud Build() const {
    Cloud cloud = CloudOf(BentSheet(60, 40));
    const int from = 20 + GetParam();
    KeepNodes(&cloud, [&](int row, int col) {
      return row < 20 || (row >= from && row < from + 4 && col >= 10 && col < 15);
    });
    return cloud;
  }
};

class NearIsland : public Island {};
TEST_P(NearIsland, StaysWithTheClothAroundIt) { EXPECT_TRUE(CleanCloud(Build(), {}).rejected.empty()); }
INSTANTIATE_TEST_SUITE_P(Gap, NearIsland, ::testing::Values(1, 5, 9));

class FarIsland : public Island {};
TEST_P(FarIsland, IsRejected) {
  const Cloud clean = CleanCloud(Build(), {});
  ASSERT_EQ(clean.rejected.size(), 20u);
  EXPECT_EQ(clean.rejected[0].reason, RejectReason::kSmallComponent);
}
INSTANTIATE_TEST_SUITE_P(Gap, FarIsland, ::testing::Values(10, 20));

TEST(CleanCloud, RejectsAnIslandThatLiesFarAwayInSpace) {
  Cloud cloud = CloudOf(BentSheet(60, 40));
  KeepNodes(&cloud, [](int row, int col) { return row < 20 || (row >= 22 && row < 26 && col < 5); });
  for (CloudPoint& p : cloud.points) {
    if (p.node.row >= 22) p.position_mm.z() += 200;
  }
  EXPECT_EQ(CleanCloud(cloud, {}).rejected.size(), 20u);
}

TEST(CleanCloud, KeepsTheLargestPieceHoweverSmall) {
  const Cloud cloud = CloudOf(BentSheet(5, 5));
  EXPECT_EQ(CleanCloud(cloud, {}).points.size(), 25u);
}

TEST(CleanCloud, CleansCornersApartFromCentres) {
  Cloud cloud = CloudOf(BentSheet(10, 10));
  Cloud corners = CloudOf(BentSheet(10, 10, NodeKind::kCorner));
  PointAt(&corners, 4, 4).position_mm += Eigen::Vector3d(0, 80, 0);
  cloud.points.insert(cloud.points.end(), corners.points.begin(), corners.points.end());
  const Cloud clean = CleanCloud(cloud, {});
  ASSERT_EQ(clean.rejected.size(), 1u);
  EXPECT_EQ(clean.rejected[0].node, (BoardNode{4, 4, NodeKind::kCorner}));
}

TEST(CleanCloud, KeepsPointsOfTwoViewsThatTheirNeighboursConfirm) {
  Cloud cloud = CloudOf(BentSheet(30, 40));
  PointAt(&cloud, 12, 17).views = 2;
  PointAt(&cloud, 20, 5).views = 2;
  PointAt(&cloud, 20, 5).position_mm += Eigen::Vector3d(0, 3.5, 0);  // further than the cloth reaches
  const Cloud clean = CleanCloud(cloud, {});
  ASSERT_EQ(clean.rejected.size(), 1u);
  EXPECT_EQ(clean.rejected[0].node, (BoardNode{20, 5, NodeKind::kCenter}));
  EXPECT_EQ(clean.rejected[0].reason, RejectReason::kUnconfirmed);
}

TEST(CleanCloud, RejectsPointsOfTwoViewsWithoutWitnesses) {
  Cloud cloud = CloudOf(BentSheet(30, 40));
  for (CloudPoint& p : cloud.points) p.views = p.node.col < 30 ? 5 : 2;
  const Cloud clean = CleanCloud(cloud, {});
  EXPECT_FALSE(clean.rejected.empty());
  for (const RejectedNode& r : clean.rejected) {
    EXPECT_GE(r.node.col, 32);
    EXPECT_EQ(r.reason, RejectReason::kUnconfirmed);
  }
}

TEST(CleanCloud, KeepsEarlierRejectionsAndTheirOrder) {
  Cloud cloud = CloudOf(BentSheet(20, 20));
  cloud.rejected = {{{0, 30, NodeKind::kCenter}, 2, RejectReason::kTooFewViews},
                    {{19, 30, NodeKind::kCenter}, 4, RejectReason::kNoConsensus}};
  PointAt(&cloud, 8, 8).position_mm.x() += 500;
  const Cloud clean = CleanCloud(cloud, {});
  ASSERT_EQ(clean.rejected.size(), 3u);
  EXPECT_EQ(clean.rejected[0].reason, RejectReason::kTooFewViews);
  EXPECT_EQ(clean.rejected[1].node, (BoardNode{8, 8, NodeKind::kCenter}));
  EXPECT_EQ(clean.rejected[2].reason, RejectReason::kNoConsensus);
}

TEST(CleanCloud, EmptyCloudStaysEmpty) { EXPECT_TRUE(CleanCloud({}, {}).points.empty()); }

TEST(CleanCloud, LonePointsAreIsolated) {
  Cloud cloud;
  cloud.points = {{{0, 0, 0}, {3, 3, NodeKind::kCenter}, 4, 0.1},
                  {{9, 0, 0}, {9, 9, NodeKind::kCenter}, 4, 0.1}};
  EXPECT_EQ(CleanCloud(cloud, {}).rejected.size(), 2u);
}

TEST(CleaningOptions, NamesTheFieldThatIsWrong) {
  CleaningOptions options;
  options.max_edge_ratio = 1;
  EXPECT_EQ(options.Validate().message(), "cleaning.max_edge_ratio must be greater than 1");
  EXPECT_TRUE(CleaningOptions().Validate().ok());
}

}  // namespace
}  // namespace weft
