#include "services/studio/preview/coverage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/studio/preview/coverage_picture.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

Observation Center(int row, int col) { return {0, 0, {row, col, NodeKind::kCenter}}; }

TEST(Coverage, CountsCamerasAndForgetsWhatACameraNoLongerReads) {
  Coverage coverage(2, 3, {});
  EXPECT_EQ(coverage.CellsOf("a"), -1);
  for (const char* camera : {"a", "b", "c"}) coverage.Set(camera, {Center(0, 0), Center(1, 2)});
  coverage.Set("c", {Center(0, 0), Center(0, 1), {0, 0, {1, 3, NodeKind::kCorner}}});
  EXPECT_EQ(coverage.Views(0, 0), 3);
  EXPECT_EQ(coverage.Views(1, 2), 2);
  EXPECT_EQ(coverage.CellsOf("c"), 2);
  EXPECT_THAT(coverage.Count(), ElementsAre(3, 1, 1, 1, 0));
}

TEST(Coverage, LeavesOutWhatIsNoneOfTheGarment) {
  Coverage coverage(2, 3, {{0, 1}, {1, 1}});
  coverage.Set("a", {Center(0, 0), Center(0, 1)});
  EXPECT_EQ(coverage.Views(0, 0), -1);
  EXPECT_EQ(coverage.CellsOf("a"), 1);
  EXPECT_THAT(coverage.Count(), ElementsAre(1, 1, 0, 0, 0));
}

TEST(CoveragePicture, PaintsACellByTheNumberOfItsCameras) {
  Coverage coverage(1, 3, {{0, 1}, {0, 2}});
  for (const char* camera : {"a", "b", "c"}) coverage.Set(camera, {Center(0, 2)});
  const MeshPicture picture = PaintBoard(coverage);
  const std::vector<uint8_t> png(picture.bytes.begin(), picture.bytes.end());
  const cv::Mat pixels = cv::imdecode(png, cv::IMREAD_UNCHANGED);
  ASSERT_EQ(pixels.cols, picture.width_px);
  ASSERT_GT(pixels.cols, 300);
  const auto at = [&](int cell) { return pixels.at<cv::Vec4b>(3, (2 * cell + 1) * pixels.cols / 6); };
  EXPECT_EQ(at(0)[3], 0);  // transparent
  EXPECT_EQ(at(1)[3], 255);
  EXPECT_NEAR(at(1)[0], at(1)[2], 12);  // grey
  EXPECT_GT(at(2)[0], at(2)[2] + 50);   // blue
}

TEST(CoverageClass, BeginsAtOneTwoThreeAndSixCameras) {
  const size_t expected[] = {0, 1, 2, 3, 3, 3, 4, 4};
  for (int views = 0; views < 8; ++views) EXPECT_EQ(CoverageClass(views), expected[views]) << views;
}

// Five columns for the five classes, from none to six cameras.
TEST(CoveragePicture, HasAColourForEachClass) {
  Coverage coverage(1, 5, {});
  const int views[] = {0, 1, 2, 3, 6};
  for (int camera = 0; camera < 6; ++camera) {
    std::vector<Observation> seen;
    for (int col = 0; col < 5; ++col)
      if (views[col] > camera) seen.push_back(Center(0, col));
    coverage.Set("c" + std::to_string(camera), seen);
  }
  const MeshPicture picture = PaintBoard(coverage);
  EXPECT_EQ(picture.width_px, 640);
  EXPECT_EQ(picture.height_px, 128);
  EXPECT_EQ(picture.title, "The board");
  const std::vector<uint8_t> png(picture.bytes.begin(), picture.bytes.end());
  const cv::Mat pixels = cv::imdecode(png, cv::IMREAD_UNCHANGED);
  for (size_t k = 0; k < 5; ++k)
    for (const int x : {0, 127}) {
      const cv::Vec4b pixel = pixels.at<cv::Vec4b>(x, static_cast<int>(128 * k) + x);
      const std::string hex = CoverageColor(k);
      ASSERT_EQ(hex.size(), 7u);
      for (size_t c = 0; c < 3; ++c)
        EXPECT_EQ(pixel[static_cast<int>(2 - c)], std::stoi(hex.substr(1 + 2 * c, 2), nullptr, 16)) << k;
      EXPECT_EQ(pixel[3], 255);
    }
}

// What a vertex looks like, by its node alone: the picture of a triangle whose vertices are all that node.
class GarmentPictureTest : public ::testing::Test {
 protected:
  GarmentPictureTest() {
    garment_.rest = {{{0, 0, 0}, {100, 0, 0}, {0, 100, 0}}, {{0, 2, 1}}};
    const int views[3][3] = {{3, 1, 0}, {2, 2, 0}, {0, 0, 6}};
    for (int camera = 0; camera < 6; ++camera) {
      std::vector<Observation> seen;
      for (int row = 0; row < 3; ++row)
        for (int col = 0; col < 3; ++col)
          if (views[row][col] > camera) seen.push_back(Center(row, col));
      coverage_->Set("c" + std::to_string(camera), seen);
    }
  }
  std::string Picture(const VertexNode& node) {
    garment_.node_of_vertex.assign(3, node);
    const auto pictures = PaintGarment(garment_, *coverage_);
    EXPECT_TRUE(pictures.ok()) << pictures.status();
    if (!pictures.ok() || pictures->empty()) return "";
    return pictures->front().bytes + (*pictures).back().bytes;
  }

  Template garment_;
  std::optional<Coverage> coverage_{std::in_place, 3, 3, std::vector<std::pair<int, int>>()};
};

TEST_F(GarmentPictureTest, CellsHaveTheColourOfTheirCameras) {
  const std::vector<std::string> classes = {Picture({0, 2}), Picture({0, 1}), Picture({1, 0}),
                                            Picture({0, 0}), Picture({2, 2}), Picture({})};
  for (size_t i = 0; i < classes.size(); ++i)
    for (size_t k = 0; k < i; ++k) EXPECT_NE(classes[i], classes[k]) << i << " " << k;
  EXPECT_EQ(Picture({1, 1}), Picture({1, 0})) << "two cameras each";
  EXPECT_EQ(Picture({3, 0}), Picture({})) << "not on the board";
}

TEST_F(GarmentPictureTest, CornersAreSeenAsTheWorstCellAroundThem) {
  const auto corner = [&](int row, int col) { return Picture({row, col, NodeKind::kCorner}); };
  EXPECT_EQ(corner(1, 1), Picture({0, 1}));  // of 3, 1, 2 and 2
  EXPECT_EQ(corner(0, 0), Picture({0, 0}));  // the others lie outside of the board
  EXPECT_EQ(corner(1, 0), Picture({1, 0}));
  EXPECT_EQ(corner(0, 1), Picture({0, 1}));
  EXPECT_EQ(corner(3, 3), Picture({2, 2}));
  EXPECT_EQ(corner(4, 4), Picture({}));
  // Cells that are none of the garment do not count.
  coverage_.emplace(3, 3, std::vector<std::pair<int, int>>{{1, 1}});
  coverage_->Set("c", {Center(1, 1), Center(0, 0)});
  EXPECT_EQ(corner(1, 1), Picture({1, 1}));
  EXPECT_EQ(corner(0, 0), Picture({}));
}

}  // namespace
}  // namespace weft
