#include "alignment/hidden_stages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "alignment/align.h"
#include "tests/alignment/cloth_sheets.h"

namespace weft {
namespace {

using testing::FlatSheet;
using ::testing::HasSubstr;
using testing::kCellMm;
using testing::Mapped;
using testing::Measure;
using testing::SheetTemplate;

constexpr int kBumpRows = 40, kBumpCols = 50;

bool Hidden(int v) { return std::hypot(v / kBumpCols - kBumpRows / 2, v % kBumpCols - kBumpCols / 2) <= 9; }

// A dent of 6 mm where nobody looks; how deep it is only a scan can tell.
Eigen::Vector3d Dented(const Eigen::Vector3d& p) {
  const double x = p.x() - kBumpCols / 2 * kCellMm, y = p.y() - kBumpRows / 2 * kCellMm;
  return p - Eigen::Vector3d(0, 0, 6 * std::exp(-(x * x + y * y) / (2 * 64)));
}

Scan ScanOf(double noise_mm) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, noise_mm);
  Scan scan;
  for (double x = 0; x < (kBumpCols - 1) * kCellMm; x += 1.1) {
    for (double y = 0; y < (kBumpRows - 1) * kCellMm; y += 1.1) {
      scan.points_mm.push_back(Dented({x, y, 0}) + Eigen::Vector3d(0, 0, noise(random)));
    }
  }
  scan.normals.assign(scan.points_mm.size(), Eigen::Vector3d::UnitZ());
  return scan;
}

double HiddenError(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& truth) {
  return testing::MeanError(a, truth, Hidden);
}

class HiddenStages : public ::testing::Test {
 protected:
  const Template garment_ = SheetTemplate(FlatSheet(kBumpRows, kBumpCols));
  const AlignmentModel model_{garment_};
  const std::vector<Eigen::Vector3d> truth_ = Mapped(garment_.rest.vertices_mm, Dented);
  const std::vector<VertexTarget> targets_ = Measure(truth_, 0.05, 1, [](int v) { return !Hidden(v); });
};

TEST_F(HiddenStages, AScanShowsWhatThePatternDoesNot) {
  const Scan scan = ScanOf(0.3);
  const auto alone = Align(model_, targets_, AlignOptions{});
  const auto scanned = Align(model_, targets_, AlignOptions{}, {.scan = &scan});
  ASSERT_TRUE(alone.ok() && scanned.ok());
  EXPECT_LT(HiddenError(scanned->mesh.vertices_mm, truth_),
            0.4 * HiddenError(alone->mesh.vertices_mm, truth_));
  // Measured vertices are frozen.
  for (const VertexTarget& t : targets_) {
    EXPECT_LT((scanned->mesh.vertices_mm[t.vertex] - alone->mesh.vertices_mm[t.vertex]).norm(), 1e-4);
  }
}

TEST_F(HiddenStages, AScanFarAwaySaysNothingAndIsCounted) {
  Scan scan = ScanOf(0);
  for (Eigen::Vector3d& p : scan.points_mm) p.z() += 300;
  const auto alone = Align(model_, targets_, AlignOptions{});
  const auto away = Align(model_, targets_, AlignOptions{}, {.scan = &scan});
  ASSERT_TRUE(alone.ok() && away.ok());
  EXPECT_LT(testing::MaxDistance(away->mesh.vertices_mm, alone->mesh.vertices_mm), 0.1);
  EXPECT_EQ(away->scan.found, 0);
  EXPECT_EQ(away->scan.vertices, 0);
}

TEST_F(HiddenStages, AScanIsCounted) {
  const Scan scan = ScanOf(0);
  const auto scanned = Align(model_, targets_, AlignOptions{}, {.scan = &scan});
  ASSERT_TRUE(scanned.ok()) << scanned.status();
  EXPECT_EQ(scanned->scan.found, static_cast<int>(scan.points_mm.size()));
  const auto hidden = garment_.rest.vertices_mm.size() - targets_.size();
  EXPECT_GT(scanned->scan.vertices, 0.9 * static_cast<double>(hidden));
  EXPECT_LE(scanned->scan.vertices, static_cast<int>(hidden));
  EXPECT_LT(scanned->scan.median_distance_mm, 0.1);
  EXPECT_FALSE(scanned->scan.is_turned);
  AlignOptions without;
  without.recon.weight = 0;
  EXPECT_EQ(Align(model_, targets_, without, {.scan = &scan})->scan.found, 0);
}

TEST_F(HiddenStages, NormalsThatPointInwardsAreTurned) {
  const Scan scan = ScanOf(0.3);
  Scan inward = scan;
  for (Eigen::Vector3d& n : inward.normals) n = -n;
  const auto right = Align(model_, targets_, AlignOptions{}, {.scan = &scan});
  const auto turned = Align(model_, targets_, AlignOptions{}, {.scan = &inward});
  ASSERT_TRUE(right.ok() && turned.ok());
  EXPECT_TRUE(turned->scan.is_turned);
  EXPECT_EQ(turned->scan.found, right->scan.found);
  EXPECT_EQ(testing::MaxDistance(turned->mesh.vertices_mm, right->mesh.vertices_mm), 0);
}

TEST_F(HiddenStages, OfAScanOfBothSidesOfThickClothTheOuterCounts) {
  const Scan outer = ScanOf(0);
  for (const double sign : {1.0, -1.0}) {  // as it should be, and with all normals inwards
    Scan both = outer;
    for (size_t i = 0; i < outer.points_mm.size(); ++i) {
      both.points_mm.push_back(outer.points_mm[i] - 5 * outer.normals[i]);
      both.normals.push_back(-outer.normals[i]);
    }
    for (Eigen::Vector3d& n : both.normals) n *= sign;
    const auto one = Align(model_, targets_, AlignOptions{}, {.scan = &outer});
    const auto two = Align(model_, targets_, AlignOptions{}, {.scan = &both});
    ASSERT_TRUE(one.ok() && two.ok());
    EXPECT_EQ(two->scan.is_turned, sign < 0);
    EXPECT_LT(testing::MaxDistance(two->mesh.vertices_mm, one->mesh.vertices_mm), 1e-9);
  }
}

TEST_F(HiddenStages, AScanInAnotherUnitIsRefusedByName) {
  // The origin of the world lies on the cloth, where the scan in metres is a dot.
  const std::pair<double, const char*> units[] = {
      {1000, "is in metres"}, {10, "is in centimetres"}, {25.4, "is in inches"}, {304.8, "is in feet"}};
  for (const auto& [mm, named] : units) {
    Scan scan = ScanOf(0.3);
    scan.name = "scans/0000.ply";
    for (Eigen::Vector3d& p : scan.points_mm) p /= mm;
    const absl::Status status = Align(model_, targets_, AlignOptions{}, {.scan = &scan}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(std::string("scans/0000.ply: ") + named));
  }
}

TEST_F(HiddenStages, AScanInMetresIsRefusedInAnyPlace) {
  Scan scan = ScanOf(0.3);
  for (Eigen::Vector3d& p : scan.points_mm) p = p / 1000 + Eigen::Vector3d(0.01, 3, 7);
  EXPECT_THAT(std::string(Align(model_, targets_, AlignOptions{}, {.scan = &scan}).status().message()),
              HasSubstr("is it in metres?"));
}

TEST_F(HiddenStages, AScanOfASmallPartIsInMm) {
  Scan part;
  const Scan whole = ScanOf(0.3);
  for (size_t i = 0; i < whole.points_mm.size(); ++i) {
    if (whole.points_mm[i].head<2>().norm() > 25) continue;
    part.points_mm.push_back(whole.points_mm[i]);
    part.normals.push_back(whole.normals[i]);
  }
  EXPECT_TRUE(Align(model_, targets_, AlignOptions{}, {.scan = &part}).ok());
}

TEST_F(HiddenStages, PushMovesHiddenVerticesAgainstTheirNormals) {
  AlignOptions options;
  const auto still = Align(model_, targets_, options);
  options.push = {.weight = 0.05, .depth_mm = 2};
  const auto pushed = Align(model_, targets_, options);
  ASSERT_TRUE(still.ok() && pushed.ok());
  const int middle = kBumpRows / 2 * kBumpCols + kBumpCols / 2;
  EXPECT_LT(pushed->mesh.vertices_mm[middle].z(), still->mesh.vertices_mm[middle].z() - 0.5);
  EXPECT_LT((pushed->mesh.vertices_mm[0] - still->mesh.vertices_mm[0]).norm(), 1e-4);
}

TEST_F(HiddenStages, StopWhenCancelled) {
  int asked = 0;
  const AlignContext context{.cancelled = [&asked] { return ++asked > 3; }};
  EXPECT_EQ(Align(model_, targets_, AlignOptions{}, context).status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(asked, 4);
}

TEST(AssociateScan, GivesEveryPointToItsClosestVertexAndAverages) {
  const TriangleMesh sheet = FlatSheet(4, 4);
  Scan scan;
  scan.points_mm = {{0.1, 0, 1}, {-0.1, 0.2, 3}, {kCellMm, 0.3, 1}, {500, 0, 0}, {2 * kCellMm, kCellMm, 0.5}};
  std::vector<bool> wanted(16, true);
  wanted[1] = false;  // takes its point and does nothing with it
  const auto pulls = AssociateScan(scan, sheet.vertices_mm, sheet.faces, wanted, {});
  ASSERT_EQ(pulls.size(), 2u);
  EXPECT_EQ(pulls[0].vertex, 0);
  EXPECT_EQ(pulls[0].points, 2);
  EXPECT_LT((pulls[0].position_mm - Eigen::Vector3d(0, 0.1, 2)).norm(), 1e-12);
  EXPECT_EQ(pulls[1].vertex, 6);
  EXPECT_LT((pulls[1].normal - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(AssociateScan, FindsWhatComparingAllPairsFinds) {
  const TriangleMesh sheet = FlatSheet(20, 20);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> at(-20, 70), height(-8, 8);
  Scan scan;
  for (int i = 0; i < 2000; ++i) scan.points_mm.emplace_back(at(random), at(random), height(random));
  AssociationOptions options;
  std::vector<int> expected(400, 0);
  for (const Eigen::Vector3d& p : scan.points_mm) {
    size_t nearest = 0;
    for (size_t v = 1; v < 400; ++v) {
      if ((sheet.vertices_mm[v] - p).norm() < (sheet.vertices_mm[nearest] - p).norm()) nearest = v;
    }
    if ((sheet.vertices_mm[nearest] - p).norm() <= options.max_distance_mm) ++expected[nearest];
  }
  std::vector<int> found(400, 0);
  for (const ScanPull& pull :
       AssociateScan(scan, sheet.vertices_mm, sheet.faces, std::vector<bool>(400, true), options)) {
    found[pull.vertex] = pull.points;
  }
  EXPECT_EQ(found, expected);
}

TEST(HiddenStageOptions, NameTheFieldThatIsWrong) {
  AlignOptions options;
  options.recon.tangential_share = 2;
  EXPECT_THAT(options.Validate().message(), HasSubstr("recon.tangential_share"));
  options = {};
  options.push.weight = -1;
  EXPECT_THAT(options.Validate().message(), HasSubstr("push.weight"));
  options = {};
  options.recon.association.max_distance_mm = 0;
  EXPECT_THAT(options.Validate().message(), HasSubstr("recon.association.max_distance_mm"));
}

}  // namespace
}  // namespace weft
