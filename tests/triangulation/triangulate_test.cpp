#include "triangulation/triangulate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/triangulation/synthetic_views.h"

namespace weft {
namespace {

using testing::BentSheet;
using ::testing::HasSubstr;
using testing::NodeTruth;
using testing::Observe;
using testing::RingRig;

const BoardNode kNode{3, 4, NodeKind::kCenter};
const Eigen::Vector3d kPoint(20, -35, 60);

// Without what two views alone give.
TriangulationOptions Options() {
  TriangulationOptions options;
  options.two_view.accept = false;
  return options;
}

Observation Seen(const CameraModel& camera, const Eigen::Vector3d& point, const BoardNode& node = kNode) {
  const Eigen::Vector2d pixel = *camera.Project(point);
  return {pixel.x(), pixel.y(), node, 0.1f, 0.99f};
}

TEST(Triangulate, FindsPointsOfNoiselessViewsExactly) {
  const Rig rig = RingRig(12);
  const std::vector<NodeTruth> truth = BentSheet(6, 9);
  const auto cloud = Triangulate(rig, Observe(rig, truth, 1e-9, 1), Options());
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_EQ(cloud->points.size(), truth.size());
  for (size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(cloud->points[i].node, truth[i].node);
    EXPECT_LT((cloud->points[i].position_mm - truth[i].position_mm).norm(), 1e-5);
    EXPECT_EQ(cloud->points[i].views, 12);
  }
}

TEST(Triangulate, OrdersByKindThenRowThenColumn) {
  const Rig rig = RingRig(6);
  std::vector<NodeTruth> truth = BentSheet(3, 3, NodeKind::kCorner);
  for (const NodeTruth& t : BentSheet(3, 3)) truth.push_back(t);
  std::reverse(truth.begin(), truth.end());
  const auto cloud = Triangulate(rig, Observe(rig, truth, 0.05, 2), Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points.size(), 18u);
  const auto key = [](const CloudPoint& p) { return std::tuple(p.node.kind, p.node.row, p.node.col); };
  EXPECT_TRUE(std::is_sorted(cloud->points.begin(), cloud->points.end(),
                             [&](const auto& a, const auto& b) { return key(a) < key(b); }));
}

TEST(Triangulate, RejectsNodeSeenByTwoCamerasOnly) {
  const Rig rig = RingRig(6);
  const auto cloud =
      Triangulate(rig, {{0, {Seen(rig.cameras[0], kPoint)}}, {2, {Seen(rig.cameras[2], kPoint)}}}, Options());
  ASSERT_TRUE(cloud.ok());
  EXPECT_TRUE(cloud->points.empty());
  ASSERT_EQ(cloud->rejected.size(), 1u);
  EXPECT_EQ(cloud->rejected[0].reason, RejectReason::kTooFewViews);
  EXPECT_EQ(cloud->rejected[0].views, 2);
  EXPECT_EQ(cloud->rejected[0].node, kNode);
}

TEST(Triangulate, TakesTwoRaysThatMeetWell) {
  const Rig rig = RingRig(6);
  const auto cloud =
      Triangulate(rig, {{0, {Seen(rig.cameras[0], kPoint)}}, {2, {Seen(rig.cameras[2], kPoint)}}}, {});
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points.size(), 1u);
  EXPECT_EQ(cloud->points[0].views, 2);
  EXPECT_LT((cloud->points[0].position_mm - kPoint).norm(), 1e-3);
}

TEST(Triangulate, RejectsTwoRaysThatMissEachOtherOrLieTooClose) {
  const Rig rig = RingRig(6);
  Observation off = Seen(rig.cameras[2], kPoint);
  off.y_px += 1;  // ten sigmas
  const auto apart = Triangulate(rig, {{0, {Seen(rig.cameras[0], kPoint)}}, {2, {off}}}, {});
  ASSERT_TRUE(apart.ok());
  EXPECT_TRUE(apart->points.empty());
  const Rig close = RingRig(180);  // cameras 0 and 3: 6 degrees apart
  const auto narrow =
      Triangulate(close, {{0, {Seen(close.cameras[0], kPoint)}}, {3, {Seen(close.cameras[3], kPoint)}}}, {});
  ASSERT_TRUE(narrow.ok());
  EXPECT_TRUE(narrow->points.empty());
}

TEST(Triangulate, CountsACameraOnceHoweverOftenItSeesANode) {
  const Rig rig = RingRig(6);
  const Observation a = Seen(rig.cameras[0], kPoint), b = Seen(rig.cameras[2], kPoint);
  const auto cloud = Triangulate(rig, {{0, {a, a}}, {2, {b}}}, Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->rejected.size(), 1u);
  EXPECT_EQ(cloud->rejected[0].reason, RejectReason::kTooFewViews);
}

TEST(Triangulate, TakesTheBestOfACamerasTwoObservations) {
  const Rig rig = RingRig(6);
  const Observation good = Seen(rig.cameras[0], kPoint);
  const Observation bad = Seen(rig.cameras[0], kPoint + Eigen::Vector3d(0, 40, 0));
  const auto cloud = Triangulate(
      rig, {{0, {bad, good}}, {1, {Seen(rig.cameras[1], kPoint)}}, {2, {Seen(rig.cameras[2], kPoint)}}},
      Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points.size(), 1u);
  EXPECT_EQ(cloud->points[0].views, 3);
  EXPECT_LT((cloud->points[0].position_mm - kPoint).norm(), 1e-6);
}

TEST(Triangulate, APixelThatNoRayHasSaysNothingAboutTheOthers) {
  const Rig rig = RingRig(6);
  std::vector<ViewObservations> views;
  for (int c = 0; c < 6; ++c) views.push_back({c, {Seen(rig.cameras[c], kPoint)}});
  const auto expected = Triangulate(rig, {views.begin() + 1, views.end()}, Options());
  for (const double x_px : {1e6, 1e30, 1e300}) {
    views[0].observations[0].x_px = x_px;
    const auto cloud = Triangulate(rig, views, Options());
    ASSERT_TRUE(cloud.ok());
    ASSERT_EQ(cloud->points.size(), 1u) << x_px;
    EXPECT_EQ(cloud->points[0].views, 5);
    EXPECT_LT((cloud->points[0].position_mm - expected->points[0].position_mm).norm(), 1e-6) << x_px;
  }
}

TEST(Triangulate, RejectsRaysThatDoNotMeet) {
  const Rig rig = RingRig(6);
  std::vector<ViewObservations> views;
  for (int c = 0; c < 6; ++c) {
    views.push_back({c, {Seen(rig.cameras[c], kPoint + Eigen::Vector3d(0, 25.0 * c, 0))}});
  }
  const auto cloud = Triangulate(rig, views, Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->rejected.size(), 1u);
  EXPECT_EQ(cloud->rejected[0].reason, RejectReason::kNoConsensus);
  EXPECT_EQ(cloud->rejected[0].views, 6);
}

TEST(Triangulate, RejectsNearlyParallelRays) {
  Rig rig = RingRig(3);
  for (int c = 1; c < 3; ++c) {
    rig.cameras[c] = rig.cameras[0];
    rig.cameras[c].id = std::to_string(c);
    rig.cameras[c].translation_mm.x() += 25.0 * c;
  }
  std::vector<ViewObservations> views;
  for (int c = 0; c < 3; ++c) views.push_back({c, {Seen(rig.cameras[c], kPoint)}});
  TriangulationOptions options;
  options.consensus.min_pair_angle_deg = 0.1;
  options.refinement.max_sigma_mm = 0.5;
  const auto cloud = Triangulate(rig, views, options);
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->rejected.size(), 1u);
  EXPECT_EQ(cloud->rejected[0].reason, RejectReason::kPoorGeometry);
}

TEST(Triangulate, SurvivesFortyPercentWrongIdentities) {
  const Rig rig = RingRig(20);
  const std::vector<NodeTruth> truth = BentSheet(20, 20);
  std::vector<ViewObservations> views = Observe(rig, truth, 0.1, 5);
  std::mt19937 random(6);
  for (ViewObservations& view : views) {
    for (Observation& o : view.observations) {
      if (random() % 10 >= 4) continue;
      o.x_px += static_cast<int>(random() % 400) - 200;
      o.y_px += static_cast<int>(random() % 400) - 200;
    }
  }
  const auto cloud = Triangulate(rig, views, Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points.size(), truth.size());
  for (size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT((cloud->points[i].position_mm - truth[i].position_mm).norm(), 0.3);
  }
}

// The squared Mahalanobis distance of the error is chi-square with 3 degrees of freedom if the covariance is
// true.
double MeanSquaredMahalanobis(const Cloud& cloud, const std::vector<NodeTruth>& truth) {
  double sum = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector3d error = cloud.points[i].position_mm - truth[i].position_mm;
    sum += error.dot(cloud.points[i].covariance_mm2.inverse() * error);
  }
  return sum / truth.size();
}

TEST(Triangulate, CovarianceMatchesTheErrors) {
  const Rig rig = RingRig(8);
  const std::vector<NodeTruth> truth = BentSheet(40, 40);
  const auto cloud = Triangulate(rig, Observe(rig, truth, 0.2, 7), Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points.size(), truth.size());
  EXPECT_NEAR(MeanSquaredMahalanobis(*cloud, truth), 3, 0.35);
}

TEST(Triangulate, CovarianceGrowsWhenObservationsScatterMoreThanTheySay) {
  const Rig rig = RingRig(8);
  const std::vector<NodeTruth> truth = BentSheet(40, 40);
  std::vector<ViewObservations> views = Observe(rig, truth, 0.3, 8);
  for (ViewObservations& view : views) {
    for (Observation& o : view.observations) o.sigma_px = 0.15f;
  }
  const auto cloud = Triangulate(rig, views, Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points.size(), truth.size());
  EXPECT_NEAR(MeanSquaredMahalanobis(*cloud, truth), 3, 0.9);
}

TEST(Triangulate, CovarianceIsLargerWhereRaysMeetLessWell) {
  // Half of the sheet was decoded three times as badly, with the same sigma_px.
  const Rig rig = RingRig(8);
  const std::vector<NodeTruth> truth = BentSheet(40, 40);
  std::vector<ViewObservations> views = Observe(rig, truth, 0.05, 9);
  const std::vector<ViewObservations> rough = Observe(rig, truth, 0.15, 10);
  for (size_t v = 0; v < views.size(); ++v) {
    for (size_t i = 0; i < views[v].observations.size(); ++i) {
      Observation& o = views[v].observations[i];
      if (o.node.row >= 20) o = rough[v].observations[i];
      o.sigma_px = 0.11f;
    }
  }
  const auto cloud = Triangulate(rig, views, Options());
  ASSERT_TRUE(cloud.ok());
  ASSERT_EQ(cloud->points.size(), truth.size());
  double smooth_mm = 0, rough_mm = 0;
  for (const CloudPoint& p : cloud->points) (p.node.row < 20 ? smooth_mm : rough_mm) += p.sigma_mm;
  EXPECT_GT(rough_mm, 1.5 * smooth_mm);
  EXPECT_NEAR(MeanSquaredMahalanobis(*cloud, truth), 3, 0.7);
}

TEST(Triangulate, CovarianceHoldsWhatTheCalibrationLeaves) {
  // Every camera is off by its own amount, the same for all nodes of this small sheet; one rig after the
  // other.
  const Rig rig = RingRig(8);
  const std::vector<NodeTruth> truth = BentSheet(2, 2);
  std::mt19937 random(12);
  std::normal_distribution<double> unit(0, 1);
  TriangulationOptions options = Options();
  for (int c = 0; c < 8; ++c) options.refinement.camera_sigma_px.push_back(c < 4 ? 0.2 : 0.6);
  double sum = 0;
  constexpr int kRigs = 400;
  for (int k = 0; k < kRigs; ++k) {
    std::vector<ViewObservations> views = Observe(rig, truth, 0.05, 100 + k);
    for (ViewObservations& view : views) {
      const double sigma = options.refinement.camera_sigma_px[view.camera];
      const double x = sigma * unit(random), y = sigma * unit(random);
      for (Observation& o : view.observations) o.x_px += x, o.y_px += y;
    }
    const auto cloud = Triangulate(rig, views, options);
    ASSERT_TRUE(cloud.ok());
    ASSERT_EQ(cloud->points.size(), truth.size());
    sum += MeanSquaredMahalanobis(*cloud, truth);
  }
  EXPECT_NEAR(sum / kRigs, 3, 0.6);
  options.refinement.camera_sigma_px.pop_back();
  EXPECT_THAT(Triangulate(rig, Observe(rig, truth, 0.05, 1), options).status().message(),
              HasSubstr("camera_sigma_px has 7 entries, the rig has 8"));
}

TEST(Triangulate, RejectsRaysFromOneDirection) {
  const Rig rig = RingRig(360);  // neighbours are 1 degree apart, at three heights
  const auto seen = [&](int a, int b, int c) {
    std::vector<ViewObservations> views;
    for (const int i : {a, b, c}) views.push_back({i, {Seen(rig.cameras[i], kPoint)}});
    TriangulationOptions options = Options();
    options.refinement.min_angle_deg = 10;
    return *Triangulate(rig, views, options);
  };
  EXPECT_EQ(seen(0, 9, 18).points.size(), 1u);
  const Cloud narrow = seen(0, 3, 6);
  ASSERT_EQ(narrow.rejected.size(), 1u);
  EXPECT_EQ(narrow.rejected[0].reason, RejectReason::kPoorGeometry);
}

TEST(Triangulate, SameBytesAtAnyThreadCountAndOrderOfViews) {
  const Rig rig = RingRig(20);
  std::vector<ViewObservations> views = Observe(rig, BentSheet(30, 30), 0.2, 9);
  const auto one = tbb::task_arena(1).execute([&] { return Triangulate(rig, views, Options()); });
  std::reverse(views.begin(), views.end());
  const auto four = tbb::task_arena(4).execute([&] { return Triangulate(rig, views, Options()); });
  ASSERT_TRUE(one.ok() && four.ok());
  ASSERT_EQ(one->points.size(), four->points.size());
  for (size_t i = 0; i < one->points.size(); ++i) {
    EXPECT_EQ(one->points[i].position_mm, four->points[i].position_mm);
    EXPECT_EQ(one->points[i].covariance_mm2, four->points[i].covariance_mm2);
  }
}

void ExpectSameBytes(const Cloud& a, const Cloud& b) {
  ASSERT_EQ(a.points.size(), b.points.size());
  for (size_t i = 0; i < a.points.size(); ++i) {
    ASSERT_EQ(a.points[i].node, b.points[i].node);
    ASSERT_EQ(a.points[i].position_mm, b.points[i].position_mm);
    ASSERT_EQ(a.points[i].covariance_mm2, b.points[i].covariance_mm2);
  }
  ASSERT_EQ(a.rejected.size(), b.rejected.size());
}

TEST(Triangulate, SameBytesInAnyOrderOfObservationsAndParts) {
  // More observations than one part of the board holds, centres and corners; rows of 70 nodes end inside a
  // group. The order of the board, another one, and cameras whose observations come in two views.
  const Rig rig = RingRig(15);
  std::vector<NodeTruth> truth = BentSheet(140, 70);
  for (const NodeTruth& t : BentSheet(140, 71, NodeKind::kCorner)) truth.push_back(t);
  std::vector<ViewObservations> views = Observe(rig, truth, 0.1, 11);
  const auto ordered = Triangulate(rig, views, Options());
  ASSERT_TRUE(ordered.ok()) << ordered.status();
  ASSERT_EQ(ordered->points.size(), truth.size());
  std::vector<ViewObservations> halves;
  for (const ViewObservations& view : views) {
    const auto middle = view.observations.begin() + static_cast<int64_t>(view.observations.size() / 3);
    halves.push_back({view.camera, {view.observations.begin(), middle}});
    halves.push_back({view.camera, {middle, view.observations.end()}});
  }
  const auto halved = Triangulate(rig, halves, Options());
  ASSERT_TRUE(halved.ok()) << halved.status();
  ExpectSameBytes(*ordered, *halved);
  std::mt19937 random(12);
  for (ViewObservations& view : views)
    std::shuffle(view.observations.begin(), view.observations.end(), random);
  const auto shuffled = Triangulate(rig, views, Options());
  ASSERT_TRUE(shuffled.ok()) << shuffled.status();
  ExpectSameBytes(*ordered, *shuffled);
  views[4].observations[700].sigma_px = std::nanf("");
  EXPECT_THAT(Triangulate(rig, views, Options()).status().message(), HasSubstr("by camera 404: sigma_px"));
}

TEST(Triangulate, SeesAroundAGroupsNodeThatOneCameraPutsFarAway) {
  // Neighbours share nothing but their place in memory: nodes beside a wrong one keep their bytes.
  const Rig rig = RingRig(9);
  const std::vector<NodeTruth> truth = BentSheet(1, 16);
  std::vector<ViewObservations> views = Observe(rig, truth, 0.1, 13);
  const auto before = Triangulate(rig, views, Options());
  for (ViewObservations& view : views) view.observations[5].x_px += 60.0 * (view.camera % 4);
  const auto after = Triangulate(rig, views, Options());
  ASSERT_TRUE(before.ok() && after.ok());
  ASSERT_EQ(before->points.size(), 16u);
  ASSERT_GE(after->points.size(), 15u);
  for (const CloudPoint& point : after->points) {
    if (point.node.col == 5) continue;
    EXPECT_EQ(point.position_mm, before->points[point.node.col].position_mm);
  }
}

TEST(Triangulate, NamesTheObservationThatIsWrong) {
  const Rig rig = RingRig(4);
  Observation o = Seen(rig.cameras[0], kPoint);
  o.x_px = std::nan("");
  EXPECT_THAT(Triangulate(rig, {{0, {o}}}, Options()).status().message(),
              HasSubstr("center (3, 4) by camera 400: x_px or y_px is not finite"));
  o = Seen(rig.cameras[0], kPoint);
  o.sigma_px = 0;
  EXPECT_THAT(Triangulate(rig, {{0, {o}}}, Options()).status().message(), HasSubstr("sigma_px"));
  o.node.row = -1;
  EXPECT_THAT(Triangulate(rig, {{0, {o}}}, Options()).status().message(), HasSubstr("0 to 4096"));
  EXPECT_THAT(Triangulate(rig, {{7, {}}}, Options()).status().message(), HasSubstr("the rig has 4 cameras"));
}

TEST(Triangulate, NoViewsGiveAnEmptyCloud) {
  const auto cloud = Triangulate(RingRig(4), {}, Options());
  ASSERT_TRUE(cloud.ok());
  EXPECT_TRUE(cloud->points.empty() && cloud->rejected.empty());
}

TEST(TriangulationOptions, NamesTheFieldThatIsWrong) {
  TriangulationOptions options;
  options.consensus.min_views = 1;
  EXPECT_THAT(options.Validate().message(), HasSubstr("triangulation.consensus.min_views"));
  options = {};
  options.refinement.max_sigma_mm = std::nan("");
  EXPECT_THAT(options.Validate().message(), HasSubstr("triangulation.refinement.max_sigma_mm"));
}

}  // namespace
}  // namespace weft
