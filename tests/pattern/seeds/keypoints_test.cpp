#include "pattern/seeds/keypoints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

namespace weft {
namespace {

struct Point {
  double x, y;
};

template <typename Grey>
ColorImage DrawImage(int width_px, int height_px, const Grey& grey) {
  ColorImage image{width_px, height_px,
                   PixelVector<uint8_t>(4 * static_cast<size_t>(width_px) * height_px, uint8_t{0})};
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const auto value = static_cast<uint8_t>(std::clamp(std::lround(grey(x, y)), 0L, 255L));
      std::fill_n(image.row(y) + 4 * x, 3, value);
    }
  }
  return image;
}

// White squares between dark lines, both as wide as on a board, blurred: the product of what blurred edges
// leave of each axis. Middles are at whole numbers of pitches from `first`.
ColorImage WhiteCells(int side_px, double pitch_px, Point first, double blur_px) {
  const auto share = [&](double x) {
    double sum = 0;
    const double cell = std::round(x / pitch_px);
    for (double k = cell - 2; k <= cell + 2; ++k) {
      const double to_left = x - (k - 0.375) * pitch_px, to_right = x - (k + 0.375) * pitch_px;
      sum += 0.5 * (std::erf(to_left / (blur_px * M_SQRT2)) - std::erf(to_right / (blur_px * M_SQRT2)));
    }
    return sum;
  };
  return DrawImage(side_px, side_px,
                   [&](int x, int y) { return 30 + 170 * share(x - first.x) * share(y - first.y); });
}

std::vector<Keypoint> Detect(const ColorImage& image, const KeypointOptions& options = {}) {
  return DetectKeypoints(BlobContrast(image, kSurroundPx), options);
}

TEST(Keypoints, LieInTheMiddlesOfCellsOfAllPitchesTheyAreFor) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int kSide = 80;
  for (const double pitch_px : {3.0, 3.7, 4.6, 5.5, 6.5}) {
    for (int trial = 0; trial < 4; ++trial) {
      const Point first{pitch_px * uniform(random), pitch_px * uniform(random)};
      std::set<std::pair<int, int>> found;
      double squares = 0;
      int inside = 0;
      for (const Keypoint& p : Detect(WhiteCells(kSide, pitch_px, first, 0.8))) {
        // The image's border has neighbours on one side only.
        if (std::min({p.x_px, p.y_px, kSide - 1 - p.x_px, kSide - 1 - p.y_px}) < pitch_px) continue;
        const double u = (p.x_px - first.x) / pitch_px, v = (p.y_px - first.y) / pitch_px;
        EXPECT_TRUE(found.insert({std::lround(u), std::lround(v)}).second) << "a cell is found once";
        squares += std::pow(pitch_px * (u - std::round(u)), 2) + std::pow(pitch_px * (v - std::round(v)), 2);
        ++inside;
      }
      EXPECT_GE(inside, std::pow((kSide - 2 * pitch_px) / pitch_px - 1, 2)) << "pitch " << pitch_px;
      // Rounded to pixels it would be 0.29 px. The largest squares are flat in the middle.
      EXPECT_LT(std::sqrt(squares / (2 * inside)), pitch_px < 6 ? 0.08 : 0.4) << "pitch " << pitch_px;
    }
  }
}

TEST(Keypoints, SingleSpotsAreFoundAtTheirSubPixelPositions) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> off(-0.5, 0.5);
  for (int trial = 0; trial < 60; ++trial) {
    const Point at{20 + off(random), 20 + off(random)};
    const auto points = Detect(DrawImage(41, 41, [&](int x, int y) {
      return 60 + 120 * std::exp(-(std::pow(x - at.x, 2) + std::pow(y - at.y, 2)) / (2 * 1.2 * 1.2));
    }));
    ASSERT_EQ(points.size(), 1u);
    EXPECT_NEAR(points[0].x_px, at.x, 0.1);
    EXPECT_NEAR(points[0].y_px, at.y, 0.1);
  }
}

TEST(Keypoints, LightDoesNotMatter) {
  const Point first{2.3, 1.1};
  const ColorImage bright = WhiteCells(60, 5, first, 0.8);
  ColorImage dim = bright;
  // Half the light, and the offset with which brightness is taken.
  for (uint8_t& value : dim.rgbx) value = static_cast<uint8_t>(std::max(0, (value + 10) / 2 - 10));
  const auto of_bright = Detect(bright), of_dim = Detect(dim);
  ASSERT_EQ(of_bright.size(), of_dim.size());
  ASSERT_GT(of_bright.size(), 80u);
  for (size_t k = 0; k < of_bright.size(); ++k) {
    EXPECT_NEAR(of_bright[k].contrast, of_dim[k].contrast, 0.03);
    EXPECT_NEAR(of_bright[k].x_px, of_dim[k].x_px, 0.1);
  }
}

TEST(Keypoints, NoneOnFlatCloth) {
  for (const uint32_t seed : {1, 2, 3, 4, 5}) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 2.5);
    // A plain shade and one that falls off.
    EXPECT_TRUE(Detect(DrawImage(120, 90, [&](int, int) { return 128 + noise(random); })).empty());
    EXPECT_TRUE(Detect(DrawImage(120, 90, [&](int x, int) { return 220 - x + noise(random); })).empty());
  }
  // Without noise two pixels never differ, and equal ones are no spot.
  EXPECT_TRUE(Detect(DrawImage(40, 40, [](int, int) { return 90; }), {.min_contrast = 0}).empty());
}

TEST(Keypoints, FaintSpotsNeedALowerLimit) {
  const ColorImage image = DrawImage(41, 41, [](int x, int y) {
    return 100 + 25 * std::exp(-(std::pow(x - 20, 2) + std::pow(y - 20, 2)) / (2 * 1.2 * 1.2));
  });
  const auto points = Detect(image, {.min_contrast = 0.05f});
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0].contrast, BlobContrast(image, 1.6f).row(20)[20]);
  EXPECT_TRUE(Detect(image, {.min_contrast = 0.3f}).empty());
}

TEST(Keypoints, GridFindsAllWithinTheRadius) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> x(0, 63), y(0, 40), anywhere(-8, 70);
  std::vector<Keypoint> points(300);
  for (Keypoint& p : points) p = {x(random), y(random), 1};
  const KeypointGrid grid(points, 64, 41);
  for (int trial = 0; trial < 300; ++trial) {
    const float at_x = anywhere(random), at_y = anywhere(random), radius_px = 0.5f + 0.04f * trial;
    std::multiset<int> visited;
    grid.Around(at_x, at_y, radius_px, [&](std::span<const KeypointGrid::Place> places) {
      for (const auto& place : places) {
        visited.insert(place.index);
        EXPECT_EQ(place.x, points[place.index].x_px);
        EXPECT_EQ(place.y, points[place.index].y_px);
      }
      return false;
    });
    for (size_t k = 0; k < points.size(); ++k) {
      const bool within = std::hypot(points[k].x_px - at_x, points[k].y_px - at_y) <= radius_px;
      EXPECT_LE(within ? 1u : 0u, visited.count(static_cast<int>(k)));
      EXPECT_LE(visited.count(static_cast<int>(k)), 1u);
    }
  }
}

TEST(KeypointGrid, NearestIsThatOfAllThatAreNotPassedOver) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> anywhere(0, 40);
  std::vector<Keypoint> points(150);
  for (Keypoint& p : points) p = {anywhere(random), anywhere(random), 1};
  const KeypointGrid grid(points, 41, 41);
  const auto is_odd = [](int index) { return index % 2 != 0; };
  for (int trial = 0; trial < 300; ++trial) {
    const float x = anywhere(random), y = anywhere(random), radius_px = 0.02f * static_cast<float>(trial);
    int nearest = -1;
    double least = radius_px;
    for (int k = 0; k < static_cast<int>(points.size()); k += 2) {
      const double distance = std::hypot(points[k].x_px - x, points[k].y_px - y);
      if (distance >= least) continue;
      least = distance;
      nearest = k;
    }
    EXPECT_EQ(grid.Nearest(x, y, radius_px, is_odd), nearest);
  }
}

}  // namespace
}  // namespace weft
