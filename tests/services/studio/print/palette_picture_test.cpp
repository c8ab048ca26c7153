#include "services/studio/print/palette_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class PalettePictureTest : public ::testing::Test {
 protected:
  PalettePictureTest() {
    for (int k = 0; k < kCellColors; ++k)
      for (int c = 0; c < 3; ++c) report_.inks[k].mean[c] = 30 * k + 10 * c;
  }
  cv::Mat Picture() const {
    EXPECT_TRUE(WritePalettePicture(report_, folder_ / "palette.png").ok());
    return cv::imread(folder_ / "palette.png");
  }
  // Right below the upper left corner of an entry, where no text is.
  static cv::Vec3b Entry(const cv::Mat& picture, int a, int b) {
    return picture.at<cv::Vec3b>(110 + 76 * a + 4, 120 + 76 * b + 4);
  }

  const TempFolder folder_;
  PaletteReport report_{};
};

TEST_F(PalettePictureTest, ShowsEveryInkAlongBothSides) {
  const cv::Mat picture = Picture();
  ASSERT_FALSE(picture.empty());
  EXPECT_EQ(picture.cols, 120 + 7 * 76 + 20);
  EXPECT_EQ(picture.rows, 110 + 7 * 76 + 80);
  for (int k = 0; k < kCellColors; ++k) {
    const cv::Vec3b ink(static_cast<uint8_t>(30 * k + 20), static_cast<uint8_t>(30 * k + 10),
                        static_cast<uint8_t>(30 * k));
    EXPECT_LE(cv::norm(cv::Vec3d(picture.at<cv::Vec3b>(110 - 50, 120 + 76 * k + 38)) - cv::Vec3d(ink)), 2)
        << k;
    EXPECT_LE(cv::norm(cv::Vec3d(picture.at<cv::Vec3b>(110 + 76 * k + 38, 30)) - cv::Vec3d(ink)), 2) << k;
  }
}

TEST_F(PalettePictureTest, WeakPairsAreRedSafeOnesGreen) {
  const cv::Vec3b white(255, 255, 255);
  EXPECT_EQ(Entry(Picture(), 0, 1), white) << "a pair that was not measured";
  const auto of = [&](double separation) {
    report_.separation[2][3] = separation;
    return Entry(Picture(), 2, 3);
  };
  const cv::Vec3b red(173, 184, 255), yellow(179, 240, 255), green(214, 242, 214);
  for (const auto& [separation, colour] :
       {std::pair{3.99, red}, std::pair{4.0, yellow}, std::pair{5.99, yellow}, std::pair{6.0, green}})
    EXPECT_LE(cv::norm(cv::Vec3d(of(separation)) - cv::Vec3d(colour)), 2) << separation;
  EXPECT_EQ(Entry(Picture(), 3, 2), white);
  report_.separation[2][2] = 9;
  EXPECT_EQ(Entry(Picture(), 2, 2), white) << "an ink and itself";
}

TEST_F(PalettePictureTest, ConfusionIsWrittenBelow) {
  report_.separation[1][4] = 7;
  const auto dark = [&] {
    const cv::Mat picture = Picture();
    int count = 0;
    for (int y = 44; y < 62; ++y)
      for (int x = 8; x < 70; ++x) count += picture.at<cv::Vec3b>(110 + 76 + y, 120 + 4 * 76 + x)[0] < 120;
    return count;
  };
  EXPECT_EQ(dark(), 0);
  report_.confusion[1][4] = 0.01;
  EXPECT_GT(dark(), 20);
}

TEST_F(PalettePictureTest, SaysWhereItCannotBeWritten) {
  const absl::Status status = WritePalettePicture(report_, folder_ / "none/palette.png");
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(std::string(status.message()), HasSubstr("none"));
}

}  // namespace
}  // namespace weft
