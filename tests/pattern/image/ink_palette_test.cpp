#include "pattern/image/ink_palette.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "pattern/decoder.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

std::vector<PaletteSample> Drawn(const std::array<Rgb, kCellColors>& means, float noise, int each) {
  std::mt19937 random(3);
  std::normal_distribution<float> unit(0, 1);
  std::vector<PaletteSample> samples;
  for (int k = 0; k < kCellColors; ++k) {
    for (int i = 0; i < each; ++i) {
      PaletteSample s{static_cast<CellColor>(k), means[k]};
      for (float& c : s.color) c += noise * unit(random);
      samples.push_back(s);
    }
  }
  return samples;
}

constexpr std::array<Rgb, kCellColors> kInks = {{{150, 60, 60},
                                                 {60, 140, 60},
                                                 {170, 160, 70},
                                                 {50, 60, 120},
                                                 {70, 60, 130},
                                                 {70, 150, 160},
                                                 {190, 190, 195}}};

TEST(InkPalette, SeparationIsDistanceOverScatter) {
  const auto report = AssessPalette(Drawn(kInks, 4, 20000));
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->weakest_a, CellColor::kBlue);
  EXPECT_EQ(report->weakest_b, CellColor::kMagenta);
  EXPECT_NEAR(report->separation[3][4], std::sqrt(500.0) / 4, 0.1);
  EXPECT_NEAR(report->separation[0][6], std::sqrt(40.0 * 40 + 130 * 130 + 135 * 135) / 4, 0.8);
  // Two equal Gaussians d apart are mistaken for each other beyond the middle.
  const double d = std::sqrt(500.0) / 4;
  EXPECT_NEAR(report->confusion[3][4], 0.5 * std::erfc(d / 2 / std::sqrt(2.0)), 0.002);
  for (const auto& row : report->confusion) {
    double sum = 0;
    for (const double share : row) sum += share;
    EXPECT_NEAR(sum, 1, 1e-9);
  }
}

TEST(InkPalette, TellsTheInkThatIsNearTwoOthersToChange) {
  std::array<Rgb, kCellColors> inks = kInks;
  inks[5] = {78, 62, 140};  // cyan near magenta, which is near blue
  const auto report = AssessPalette(Drawn(inks, 2, 500));
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->change, CellColor::kMagenta);
}

TEST(InkPalette, NeverTellsToChangeTheBareCloth) {
  std::array<Rgb, kCellColors> inks = kInks;
  inks[6] = {inks[5][0] + 12, inks[5][1], inks[5][2]};  // white beside cyan
  inks[2] = {inks[6][0] + 30, inks[6][1], inks[6][2]};  // and with yellow on its other side
  const auto report = AssessPalette(Drawn(inks, 3, 400));
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->change, CellColor::kCyan);
}

TEST(InkPalette, NeedsSamples) {
  EXPECT_EQ(AssessPalette({}).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(AssessPalette(Drawn(kInks, 1, 5)).status().message(), HasSubstr("need 8"));
}

TEST(InkPalette, ReadsAPhotographOfTheBoardInUnevenLight) {
  const Board board = *GenerateBoard(60, 60, 2.7, 5);
  const auto index = BoardIndex::Build(board);
  ASSERT_TRUE(index.ok());
  Photograph photo;
  photo.width_px = 480;
  photo.height_px = 440;
  photo.pitch_px = 8;
  const Frame frame = Render(photo, board);
  const auto decoded = DecodeView(frame, *index, DecodeOptions{});
  ASSERT_TRUE(decoded.ok());
  ASSERT_GT(decoded->observations.size(), 1600u);
  const auto samples = SampleCells(frame, board, decoded->observations);
  ASSERT_TRUE(samples.ok()) << samples.status();
  ASSERT_GT(samples->size(), 800u);
  const auto report = AssessPalette(*samples);
  ASSERT_TRUE(report.ok());
  // The renderer's inks: 0.65 colour + 0.35 grey, under a light that doubles from left to right.
  const auto& red = report->inks[0].mean;
  EXPECT_NEAR(red[0] / red[1], (0.65 + 0.35 * 355 / 765) / (0.65 * 50 / 255 + 0.35 * 355 / 765), 0.25);
  for (int k = 0; k < kCellColors; ++k) EXPECT_GT(report->confusion[k][k], 0.99);
  EXPECT_GT(report->separation[static_cast<int>(report->weakest_a)][static_cast<int>(report->weakest_b)], 6);
  // Much noise brings them together.
  photo.noise = 40;
  const Frame noisy = Render(photo, board);
  const auto worse = SampleCells(noisy, board, decoded->observations);
  ASSERT_TRUE(worse.ok());
  const auto noisy_report = AssessPalette(*worse);
  ASSERT_TRUE(noisy_report.ok());
  EXPECT_LT(noisy_report->separation[3][4], 0.5 * report->separation[3][4]);
}

TEST(InkPalette, ReadsSwatchesAlongALine) {
  Frame frame;
  frame.width_px = 400;
  frame.height_px = 120;
  frame.format = PixelFormat::kRgb8;
  auto pixels = std::make_shared<std::vector<uint8_t>>(3 * 400 * 120, 250);
  std::mt19937 random(4);
  for (int k = 0; k < 8; ++k) {
    for (int y = 40; y < 80; ++y) {
      for (int x = 20 + 48 * k - 20; x < 20 + 48 * k + 20; ++x) {
        for (int c = 0; c < 3; ++c)
          (*pixels)[3 * (400 * y + x) + c] =
              static_cast<uint8_t>((k < 7 ? kInks[k][c] : 10) + static_cast<int>(random() % 7) - 3);
      }
    }
  }
  frame.pixels = pixels;
  const auto samples = SampleSwatches(frame, {20, 60}, {20 + 48 * 7, 60});
  ASSERT_TRUE(samples.ok()) << samples.status();
  const auto report = AssessPalette(*samples);
  ASSERT_TRUE(report.ok());
  for (int k = 0; k < kCellColors; ++k)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(report->inks[k].mean[c], kInks[k][c], 0.5);
  EXPECT_THAT(SampleSwatches(frame, {20, 60}, {20 + 480, 60}).status().message(),
              HasSubstr("off the picture"));
}

}  // namespace
}  // namespace weft
