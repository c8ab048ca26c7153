#include "simulation/lens.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

LinearImage EvenGrey(int width_px, int height_px, float light) {
  return {width_px, height_px, std::vector<float>(3 * static_cast<size_t>(width_px) * height_px, light)};
}

LinearImage PointImage(int size_px) {
  LinearImage image = EvenGrey(size_px, size_px, 0);
  image.at(size_px / 2, size_px / 2)[1] = 1;
  return image;
}

struct Spread {
  double sum = 0, variance = 0;  // along x, px^2
};
Spread SpreadOf(const LinearImage& image) {
  Spread out;
  const int middle = image.width_px / 2;
  for (int y = 0; y < image.height_px; ++y)
    for (int x = 0; x < image.width_px; ++x) {
      out.sum += image.at(x, y)[1];
      out.variance += image.at(x, y)[1] * (x - middle) * (x - middle);
      EXPECT_EQ(image.at(x, y)[0], 0);
    }
  return out;
}

TEST(Lens, PointSpreadIsAGaussian) {
  LinearImage image = PointImage(41);
  BlurGaussian(1.5, &image);
  const Spread spread = SpreadOf(image);
  EXPECT_NEAR(spread.sum, 1, 1e-5);
  EXPECT_NEAR(spread.variance, 1.5 * 1.5, 0.01);
}

TEST(Lens, DefocusedPointIsADisc) {
  for (const float radius_px : {3.0f, 4.25f}) {
    LinearImage image = PointImage(41);
    BlurDefocus(std::vector<float>(41 * 41, radius_px), &image);
    const Spread spread = SpreadOf(image);
    EXPECT_NEAR(spread.sum, 1, 1e-4);
    EXPECT_NEAR(spread.variance, radius_px * radius_px / 4 + 1 / 12.0, 0.05);
    EXPECT_NEAR(image.at(20, 20)[1], 1 / (3.14159 * radius_px * radius_px), 2e-3);  // flat in the middle ...
    EXPECT_EQ(image.at(20 + static_cast<int>(radius_px) + 2, 20)[1], 0);            // ... nothing outside
  }
}

TEST(Lens, PicturesInFocusStayAsTheyAre) {
  const LinearImage before = PointImage(15);
  LinearImage image = before;
  BlurDefocus(std::vector<float>(15 * 15, 0.0f), &image);
  BlurGaussian(0, &image);
  Vignette(0, &image);
  EXPECT_EQ(image.rgb, before.rgb);
}

TEST(Lens, DefocusFollowsTheThinLens) {
  LensOptions lens;
  EXPECT_EQ(DefocusRadiusPx(lens, 4500, 1500, 1000), 0) << "a pinhole is never out of focus";
  lens.f_number = 8, lens.pixel_pitch_um = 4;
  // By similar triangles: f = 18 mm, aperture 2.25 mm; the image of the point at depth z lies at f z / (z -
  // f) and the sensor at f s / (s - f).
  const double f = 4500 * 0.004, s = 1500, z = 1000;
  const double sensor = f * s / (s - f), image = f * z / (z - f);
  const double radius_px = f / 8 * std::abs(sensor - image) / image / 2 / 0.004;
  EXPECT_NEAR(DefocusRadiusPx(lens, 4500, s, z), radius_px, 1e-9);
  EXPECT_EQ(DefocusRadiusPx(lens, 4500, s, s), 0);
}

TEST(Lens, CornersLoseTheirShareOfTheLight) {
  LinearImage image = EvenGrey(31, 31, 1);
  Vignette(0.3, &image);
  EXPECT_NEAR(image.at(0, 0)[2], 0.7, 1e-6);
  EXPECT_NEAR(image.at(15, 15)[2], 1, 1e-6);
}

TEST(Lens, OptionsOutOfRangeAreNamed) {
  LensOptions lens;
  lens.f_number = 0.1;
  EXPECT_NE(lens.Validate().message().find("f_number"), std::string::npos);
}

}  // namespace
}  // namespace weft
