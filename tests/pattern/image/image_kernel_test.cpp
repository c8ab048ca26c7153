#include "pattern/image/image_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "capture/image/frame.h"
#include "pattern/image/color_image.h"
#include "pattern/seeds/keypoints.h"

namespace weft {
namespace {

std::vector<const ImageKernels*> ImageKernelsThatRunHere() {
  std::vector<const ImageKernels*> kernels = {&baseline::kImageKernels};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) kernels.push_back(&avx2::kImageKernels);
  if (&BestImageKernels() == &avx512::kImageKernels) kernels.push_back(&avx512::kImageKernels);
#endif
  return kernels;
}

Frame RandomFrame(PixelFormat format, int width_px, int height_px) {
  std::mt19937 random(static_cast<uint32_t>(width_px * 100 + height_px));
  Frame frame;
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.format = format;
  auto bytes = std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(width_px) * height_px *
                                                      BytesPerPixel(format));
  for (uint8_t& byte : *bytes) byte = static_cast<uint8_t>(random() >> 11);
  frame.pixels = bytes;
  return frame;
}

// Widths around the sizes of blocks.
constexpr std::array<int, 9> kWidths = {3, 4, 9, 15, 18, 33, 35, 66, 101};

TEST(ImageKernels, ReadColorsAsToRgb) {
  for (const PixelFormat format : {PixelFormat::kRgb8, PixelFormat::kBayerRg8, PixelFormat::kBayerGr8,
                                   PixelFormat::kBayerGb8, PixelFormat::kBayerBg8}) {
    for (const int width : kWidths) {
      const Frame frame = RandomFrame(format, width, 7);
      const auto expected = ToRgb(frame);
      const auto image = ToColorImage(frame);
      ASSERT_TRUE(expected.ok() && image.ok());
      for (int k = 0; k < width * 7; ++k) {
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(image->rgbx[4 * k + c], (*expected->pixels)[3 * k + c])
              << PixelFormatName(format) << ' ' << width << " pixel " << k;
        }
      }
    }
  }
}

TEST(ImageKernels, HalveByTheMeanOfFourPixels) {
  const auto image = ToColorImage(RandomFrame(PixelFormat::kRgb8, 75, 21));
  const ColorImage half = HalfSize(*image);
  ASSERT_EQ(half.width_px, 37);
  ASSERT_EQ(half.height_px, 10);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 37; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int sum = image->at(2 * x, 2 * y)[c] + image->at(2 * x + 1, 2 * y)[c] +
                        image->at(2 * x, 2 * y + 1)[c] + image->at(2 * x + 1, 2 * y + 1)[c];
        EXPECT_EQ(half.at(x, y)[c], (sum + 2) / 4);
      }
    }
  }
}

// The definition of BlobContrast, pixel by pixel.
double Spot(const ColorImage& image, int x, int y, double surround_px) {
  const auto smoothed = [&](double sigma) {
    const int reach = static_cast<int>(std::round(2.5 * sigma));
    double sum = 0, weights = 0;
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        const uint8_t* p =
            image.at(std::clamp(x + dx, 0, image.width_px - 1), std::clamp(y + dy, 0, image.height_px - 1));
        const double weight = std::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma));
        sum += weight * std::log(std::max({p[0], p[1], p[2]}) + 10.0);
        weights += weight;
      }
    }
    return sum / weights;
  };
  return smoothed(0.5) - smoothed(surround_px);
}

TEST(ImageKernels, ContrastOfSpotsIsAsDefined) {
  for (const int width : kWidths) {
    const auto image = ToColorImage(RandomFrame(PixelFormat::kRgb8, width, 14));
    const Plane spots = BlobContrast(*image, 1.6f);
    for (int y = 0; y < 14; ++y) {
      for (int x = 0; x < width; ++x) EXPECT_NEAR(spots.row(y)[x], Spot(*image, x, y, 1.6), 1e-4);
    }
  }
}

bool IsKeypoint(const Plane& spots, int x, int y, float contrast) {
  const float v = spots.row(y)[x];
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const float other = spots.row(y + dy)[x + dx];
      const bool before = dy < 0 || (dy == 0 && dx < 0);
      if ((dx != 0 || dy != 0) && (before ? v < other : v <= other)) return false;
    }
  }
  float least = v;
  for (int dy = -3; dy <= 3; ++dy) {
    for (int dx = -3; dx <= 3; ++dx) {
      least = std::min(
          least,
          spots.row(std::clamp(y + dy, 0, spots.height_px - 1))[std::clamp(x + dx, 0, spots.width_px - 1)]);
    }
  }
  return v > 0 && v - least >= contrast;
}

TEST(ImageKernels, KeypointsAreTheBrightPeaks) {
  for (const int width : kWidths) {
    const auto image = ToColorImage(RandomFrame(PixelFormat::kRgb8, width, 14));
    const Plane spots = BlobContrast(*image, 1.6f);
    std::vector<Keypoint> expected;
    for (int y = 1; y < 13; ++y) {
      for (int x = 1; x + 1 < width; ++x) {
        if (IsKeypoint(spots, x, y, 0.9f))
          expected.push_back({static_cast<float>(x), static_cast<float>(y), spots.row(y)[x]});
      }
    }
    const std::vector<Keypoint> found = DetectKeypoints(spots, {.min_contrast = 0.9f});
    ASSERT_EQ(found.size(), expected.size());
    for (size_t k = 0; k < found.size(); ++k) {
      EXPECT_NEAR(found[k].x_px, expected[k].x_px, 0.5f);
      EXPECT_NEAR(found[k].y_px, expected[k].y_px, 0.5f);
      EXPECT_EQ(found[k].contrast, expected[k].contrast);
    }
  }
}

TEST(ImageKernels, GiveTheSameBytesOnEveryInstructionSet) {
  const int width = 101, reach = 4;
  const auto image = ToColorImage(RandomFrame(PixelFormat::kRgb8, width, 9));
  const std::vector<float> narrow = {0.6f, 0.15f, 0.05f}, wide = {0.2f, 0.15f, 0.1f, 0.1f, 0.05f};
  std::vector<float> expected_spots;
  std::vector<uint8_t> expected_bytes;
  for (const ImageKernels* kernels : ImageKernelsThatRunHere()) {
    std::vector<std::vector<float>> brightness(9, std::vector<float>(width));
    std::vector<const float*> rows;
    for (int y = 0; y < 9; ++y) {
      kernels->brightness_row(image->at(0, y), width, brightness[y].data());
      rows.push_back(brightness[y].data());
    }
    std::vector<float> scratch(2 * (width + 2 * reach)), spots(width);
    kernels->spot_row(rows.data(), {narrow.data(), 2, wide.data(), reach}, width, scratch.data(),
                      spots.data());
    std::vector<uint8_t> bytes(4 * width + 4 * width + 2 * width);
    kernels->demosaic_row({image->at(0, 0), image->at(0, 1), image->at(0, 2), true, false}, width,
                          bytes.data());
    kernels->widen_row(image->at(0, 3), width, bytes.data() + 4 * width);
    kernels->halve_rows(image->at(0, 4), image->at(0, 5), width / 2, bytes.data() + 8 * width);
    if (kernels == &baseline::kImageKernels) {
      expected_spots = spots;
      expected_bytes = bytes;
    }
    EXPECT_EQ(spots, expected_spots);
    EXPECT_EQ(bytes, expected_bytes);
  }
}

}  // namespace
}  // namespace weft
