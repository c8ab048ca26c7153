#include "simulation/sensor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

LinearImage EvenImage(int width_px, int height_px, float red, float green, float blue) {
  LinearImage image{width_px, height_px, {}};
  for (int i = 0; i < width_px * height_px; ++i) image.rgb.insert(image.rgb.end(), {red, green, blue});
  return image;
}

SensorOptions LinearSensor() {
  SensorOptions options;
  options.gamma = 1, options.exposure = 1;
  options.noise = false;
  return options;
}

struct Statistics {
  double mean = 0, sigma = 0;
};
Statistics StatisticsOf(const std::vector<uint16_t>& values) {
  double sum = 0, squares = 0;
  for (const double v : values) sum += v, squares += v * v;
  const auto n = static_cast<double>(values.size());
  return {sum / n, std::sqrt(squares / n - sum / n * sum / n)};
}

TEST(Sensor, NoiseFollowsTheNumberOfPhotonsAndTheElectronics) {
  SensorOptions options = LinearSensor();
  options.readout = Readout::kMosaic, options.bits = 12;
  options.noise = true;
  options.full_well_electrons = 1000;
  for (const double read : {0.0, 15.0})
    for (const float light : {0.1f, 0.4f, 0.7f}) {
      options.read_noise_electrons = read;
      const Picture picture = DevelopImage(EvenImage(200, 200, light, light, light), options, "c", 0);
      const Statistics seen = StatisticsOf(picture.values);
      EXPECT_NEAR(seen.mean, light * 4095, 1.5);
      const double sigma = 4095 * std::sqrt(1000 * light + read * read) / 1000;
      EXPECT_NEAR(seen.sigma, std::sqrt(sigma * sigma + 1 / 12.0), 0.02 * sigma);
    }
}

TEST(Sensor, EveryFrameAndCameraHasNoiseOfItsOwn) {
  SensorOptions options;
  const LinearImage image = EvenImage(16, 16, 0.3f, 0.3f, 0.3f);
  const Picture one = DevelopImage(image, options, "c", 0);
  EXPECT_EQ(one.values, DevelopImage(image, options, "c", 0).values);
  EXPECT_NE(one.values, DevelopImage(image, options, "c", 1).values);
  EXPECT_NE(one.values, DevelopImage(image, options, "d", 0).values);
}

TEST(Sensor, MosaicTakesTheChannelOfItsPlace) {
  SensorOptions options = LinearSensor();
  options.readout = Readout::kMosaic;
  const LinearImage image = EvenImage(4, 4, 0.2f, 0.4f, 0.8f);
  const auto first_four = [&](PixelFormat format) {
    options.mosaic = format;
    const Frame frame = ToFrame(DevelopImage(image, options, "c", 0));
    EXPECT_TRUE(frame.Validate().ok());
    EXPECT_EQ(frame.format, format);
    return std::vector<int>{frame.row(0)[0], frame.row(0)[1], frame.row(1)[0], frame.row(1)[1]};
  };
  EXPECT_EQ(first_four(PixelFormat::kBayerRg8), (std::vector<int>{51, 102, 102, 204}));
  EXPECT_EQ(first_four(PixelFormat::kBayerGr8), (std::vector<int>{102, 51, 204, 102}));
  EXPECT_EQ(first_four(PixelFormat::kBayerGb8), (std::vector<int>{102, 204, 51, 102}));
  EXPECT_EQ(first_four(PixelFormat::kBayerBg8), (std::vector<int>{204, 102, 102, 51}));
}

TEST(Sensor, InterpolatedColorsAreRightWhereLightChangesEvenly) {
  // Linear ramps of each channel pass the interpolation unchanged, whatever the pattern.
  SensorOptions options = LinearSensor();
  options.bits = 12, options.readout = Readout::kColor;
  LinearImage image = EvenImage(24, 20, 0, 0, 0);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 24; ++x) {
      const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
      image.at(x, y)[0] = 0.2f + 0.01f * fx;
      image.at(x, y)[1] = 0.7f - 0.012f * fy;
      image.at(x, y)[2] = 0.3f + 0.005f * (fx + fy);
    }
  for (const PixelFormat mosaic :
       {PixelFormat::kBayerRg8, PixelFormat::kBayerGr8, PixelFormat::kBayerGb8, PixelFormat::kBayerBg8}) {
    options.mosaic = mosaic;
    const Picture picture = DevelopImage(image, options, "c", 0);
    for (int y = 2; y < 18; ++y)
      for (int x = 2; x < 22; ++x)
        for (int i = 0; i < 3; ++i)
          EXPECT_NEAR(picture.values[3 * (static_cast<size_t>(y) * 24 + x) + i] / 4095.0, image.at(x, y)[i],
                      2e-4);
  }
}

TEST(Sensor, ValuesFillTheirBitsAndEndAtWhite) {
  for (const int bits : {8, 10, 12}) {
    SensorOptions options = LinearSensor();
    options.readout = Readout::kBinned, options.bits = bits;
    const Picture picture = DevelopImage(EvenImage(1, 1, 0, 0.5f, 3), options, "c", 0);
    const double most = (1 << bits) - 1;
    EXPECT_EQ(picture.values[0], 0);
    EXPECT_NEAR(picture.values[1], most / 2, 0.51);
    EXPECT_EQ(picture.values[2], most);
    EXPECT_EQ(ToFrame(picture).row(0)[2], 255);
    EXPECT_NEAR(ToFrame(picture).row(0)[1], 127.5, 0.6);
  }
}

TEST(Sensor, GammaIsThePowerOfTheLight) {
  SensorOptions options = LinearSensor();
  options.readout = Readout::kBinned, options.bits = 12, options.gamma = 2.2;
  for (const float light : {0.0005f, 0.003f, 0.02f, 0.3f, 0.9f}) {
    const Picture picture = DevelopImage(EvenImage(1, 1, light, light, light), options, "c", 0);
    EXPECT_NEAR(picture.values[0], 4095 * std::pow(light, 1 / 2.2), 0.8) << light;
  }
}

TEST(Sensor, CamerasDifferInColorAndBrightnessByTheirVariation) {
  SensorOptions options = LinearSensor();
  options.readout = Readout::kBinned, options.bits = 12;
  options.color_variation = 0.03;
  constexpr int kCameras = 400;
  double squares = 0;
  for (int c = 0; c < kCameras; ++c) {
    const Picture picture = DevelopImage(EvenImage(1, 1, 0.5f, 0, 0), options, std::to_string(c), 0);
    squares += std::pow(picture.values[0] / 4095.0 / 0.5 - 1, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / kCameras), 0.03, 0.004);
}

TEST(Sensor, SharpeningLeavesEvenLightAndRaisesEdges) {
  SensorOptions options = LinearSensor();
  options.readout = Readout::kBinned, options.sharpening = 1;
  LinearImage image = EvenImage(20, 5, 0.2f, 0.2f, 0.2f);
  for (int y = 0; y < 5; ++y)
    for (int x = 10; x < 20; ++x) image.at(x, y)[0] = 0.6f;
  const Frame frame = ToFrame(DevelopImage(image, options, "c", 0));
  EXPECT_EQ(frame.row(2)[0], 51);
  EXPECT_LT(frame.row(2)[3 * 9], 51);
  EXPECT_GT(frame.row(2)[3 * 10], 153);
}

TEST(Sensor, OptionsOutOfRangeAreNamed) {
  SensorOptions sensor;
  sensor.exposure = 0;
  EXPECT_NE(sensor.Validate().message().find("exposure"), std::string::npos);
  sensor = SensorOptions();
  sensor.mosaic = PixelFormat::kRgb8;
  EXPECT_NE(sensor.Validate().message().find("mosaic"), std::string::npos);
  sensor = SensorOptions();
  sensor.bits = 14;
  EXPECT_NE(sensor.Validate().message().find("bits"), std::string::npos);
}

}  // namespace
}  // namespace weft
