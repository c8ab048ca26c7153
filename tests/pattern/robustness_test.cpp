// What cameras and files do to pictures: the cells stay right, and most are found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "pattern/decoder.h"
#include "tests/pattern/board/test_boards.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

Photograph Small(double pitch_px, double angle_deg = 20) {
  return {.width_px = 260, .height_px = 240, .pitch_px = pitch_px, .angle_deg = angle_deg};
}

// Where a pixel of the photograph went: x' = a x + b y + c, and so on.
struct Affine {
  double a = 1, b = 0, c = 0, d = 0, e = 1, f = 0;
};

struct CellsFound {
  int expected = 0, right = 0, wrong = 0;
  double RecallOf() const { return expected == 0 ? 1 : static_cast<double>(right) / expected; }
};

// Expected are cells whose surroundings are in the picture.
CellsFound FoundOf(const Photograph& photo, const Frame& frame, const Affine& moved = {}) {
  const Board& board = TestBoard().board();
  const auto place = [&](int row, int col) {
    const auto [x, y] = PixelFromBoard(photo, board, col + 0.5, row + 0.5);
    return std::pair{moved.a * x + moved.b * y + moved.c, moved.d * x + moved.e * y + moved.f};
  };
  CellsFound found;
  const double margin = 1.5 * photo.pitch_px;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      const auto [x, y] = place(row, col);
      found.expected +=
          x > margin && y > margin && x < frame.width_px - 1 - margin && y < frame.height_px - 1 - margin;
    }
  }
  const auto result = DecodeView(frame, TestBoard(), {});
  EXPECT_TRUE(result.ok()) << result.status();
  if (!result.ok()) return found;
  for (const Observation& o : result->observations) {
    if (o.node.kind != NodeKind::kCenter) continue;
    const auto [x, y] = place(o.node.row, o.node.col);
    (std::hypot(o.x_px - x, o.y_px - y) < 0.5 * photo.pitch_px ? found.right : found.wrong) += 1;
  }
  return found;
}

cv::Mat Pixels(const Frame& frame) {
  return {frame.height_px, frame.width_px, CV_8UC3, const_cast<uint8_t*>(frame.pixels->data())};
}

Frame FrameOf(const cv::Mat& pixels) {
  Frame frame;
  frame.width_px = pixels.cols;
  frame.height_px = pixels.rows;
  frame.format = pixels.channels() == 3 ? PixelFormat::kRgb8 : PixelFormat::kBayerRg8;
  frame.pixels =
      std::make_shared<std::vector<uint8_t>>(pixels.data, pixels.data + pixels.total() * pixels.elemSize());
  return frame;
}

// Smeared over `length_px` in a direction.
Frame MotionBlurred(const Frame& frame, double length_px, double angle_deg) {
  constexpr int kSteps = 16;
  cv::Mat sum = cv::Mat::zeros(frame.height_px, frame.width_px, CV_32FC3), moved, out;
  for (int k = 0; k < kSteps; ++k) {
    const double t = length_px * ((k + 0.5) / kSteps - 0.5), angle = angle_deg * M_PI / 180;
    const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, t * std::cos(angle), 0, 1, t * std::sin(angle));
    cv::warpAffine(Pixels(frame), moved, shift, Pixels(frame).size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    cv::accumulate(moved, sum);
  }
  sum.convertTo(out, CV_8UC3, 1.0 / kSteps);
  return FrameOf(out);
}

// A mosaic read at `bits`, with noise in units of 8 bits, handed on at 8 bits.
Frame Mosaicked(const Frame& frame, int bits, double noise) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  cv::Mat raw(frame.height_px, frame.width_px, CV_8UC1);
  const double scale = std::ldexp(1.0, bits - 8);
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x) {
      const double value = frame.row(y)[3 * x + (y % 2 + x % 2)] + normal(random);
      const long read = std::clamp(std::lround(value * scale), 0L, std::lround(256 * scale) - 1);
      raw.at<uint8_t>(y, x) = static_cast<uint8_t>(std::ldexp(static_cast<double>(read), 8 - bits));
    }
  }
  return FrameOf(raw);
}

TEST(Robustness, AnyRotationInThePlane) {
  for (int angle_deg = 0; angle_deg < 360; angle_deg += 45) {
    for (const int off_deg : {0, 17}) {
      const Photograph photo = Small(6.5, angle_deg + off_deg);
      const CellsFound found = FoundOf(photo, Render(photo, TestBoard().board()));
      EXPECT_GE(found.RecallOf(), 0.97) << angle_deg + off_deg << " degrees";
      EXPECT_EQ(found.wrong, 0) << angle_deg + off_deg << " degrees";
    }
  }
}

TEST(Robustness, StrongShear) {
  const Photograph photo = Small(9);
  const Frame frame = Render(photo, TestBoard().board());
  for (const double shear : {-0.8, -0.4, 0.4, 0.8}) {
    const Affine moved = {.b = shear, .c = -shear * 0.5 * photo.height_px};
    const cv::Mat matrix = (cv::Mat_<double>(2, 3) << 1, moved.b, moved.c, 0, 1, 0);
    cv::Mat out;
    cv::warpAffine(Pixels(frame), out, matrix, Pixels(frame).size(), cv::INTER_CUBIC, cv::BORDER_CONSTANT,
                   cv::Scalar::all(120));
    const CellsFound found = FoundOf(photo, FrameOf(out), moved);
    EXPECT_EQ(found.wrong, 0) << "shear " << shear;
    EXPECT_GE(found.right, 300) << "shear " << shear;
  }
}

TEST(Robustness, LargeCellsInVerySharpPictures) {
  // Corners of the printed squares are spots of their own there, and make lattices.
  for (const double pitch_px : {4, 6, 8, 10, 12, 14, 17, 20}) {
    for (const double blur_px : {0.5, 0.8, 1.2, 2.0}) {
      if (blur_px > 0.2 * pitch_px) continue;
      Photograph photo = Small(pitch_px);
      photo.width_px = static_cast<int>(16 * pitch_px);
      photo.height_px = static_cast<int>(14 * pitch_px);
      photo.bend_cells = 0.3;
      photo.blur_px = blur_px;
      const CellsFound found = FoundOf(photo, Render(photo, TestBoard().board()));
      EXPECT_GE(found.RecallOf(), 0.95) << pitch_px << " px, blur " << blur_px << " px";
      EXPECT_EQ(found.wrong, 0) << pitch_px << " px, blur " << blur_px << " px";
    }
  }
}

TEST(Robustness, MotionBlur) {
  const Photograph photo = Small(8);
  const Frame frame = Render(photo, TestBoard().board());
  for (const double angle_deg : {0.0, 30.0, 65.0, 110.0}) {
    const CellsFound found = FoundOf(photo, MotionBlurred(frame, 2.5, angle_deg));
    EXPECT_GE(found.RecallOf(), 0.95) << angle_deg << " degrees";
    EXPECT_EQ(found.wrong, 0) << angle_deg << " degrees";
    // As long as a cell: the pattern is gone along one axis.
    const CellsFound gone = FoundOf(photo, MotionBlurred(frame, 8, angle_deg));
    EXPECT_LE(gone.wrong, 0.01 * gone.right) << angle_deg << " degrees";
  }
}

TEST(Robustness, JpegArtefacts) {
  for (const int quality : {95, 75, 50}) {
    CellsFound all;
    for (double angle_deg = 0; angle_deg < 90; angle_deg += 10) {
      const Photograph photo = Small(7, angle_deg);
      const Frame frame = Render(photo, TestBoard().board());
      std::vector<uint8_t> file;
      ASSERT_TRUE(cv::imencode(".jpg", Pixels(frame), file, {cv::IMWRITE_JPEG_QUALITY, quality}));
      const CellsFound found = FoundOf(photo, FrameOf(cv::imdecode(file, cv::IMREAD_COLOR)));
      all = {all.expected + found.expected, all.right + found.right, all.wrong + found.wrong};
    }
    EXPECT_GE(all.RecallOf(), quality >= 75 ? 0.97 : 0.9) << "quality " << quality;
    // At 50, blocks of 8 x 8 pixels look like cells now and then: 1 of 14,000 here, 3 of 56,000 in other
    // views.
    EXPECT_LE(all.wrong, quality >= 75 ? 0 : 2e-4 * all.right) << "quality " << quality;
  }
}

TEST(Robustness, RawMosaics) {
  const Photograph photo = Small(6.5);
  const Frame frame = Render(photo, TestBoard().board());
  for (const int bits : {8, 12}) {
    const CellsFound found = FoundOf(photo, Mosaicked(frame, bits, 2));
    EXPECT_GE(found.RecallOf(), 0.95) << bits << " bits";
    EXPECT_EQ(found.wrong, 0) << bits << " bits";
  }
}

// Windows of random colours are on a board by chance: a share of them that is known. Pieces of other prints
// beside the garment must not be taken for the board more often than that.
TEST(Robustness, ChanceIsNotAmplified) {
  constexpr int kSide = 14, kPitchPx = 8, kIsland = 3, kApart = 5;
  const Board& board = TestBoard().board();
  int islands = 0, taken = 0;
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    const int islands_across = kSide;
    cv::Mat picture(islands_across * kApart * kPitchPx, islands_across * kApart * kPitchPx, CV_8UC3,
                    cv::Scalar(120, 120, 120));
    std::mt19937 random(seed);
    for (int k = 0; k < islands_across * islands_across; ++k, ++islands) {
      const int left = k % islands_across * kApart + 1, top = k / islands_across * kApart + 1;
      cv::rectangle(picture,
                    {left * kPitchPx - 1, top * kPitchPx - 1, kIsland * kPitchPx + 2, kIsland * kPitchPx + 2},
                    cv::Scalar(25, 25, 25), cv::FILLED);
      for (int cell = 0; cell < kIsland * kIsland; ++cell) {
        const auto rgb = CellColorRgb(static_cast<CellColor>(random() % kCellColors));
        const int x = (left + cell % kIsland) * kPitchPx + 1, y = (top + cell / kIsland) * kPitchPx + 1;
        cv::rectangle(picture, {x, y, kPitchPx - 2, kPitchPx - 2}, cv::Scalar(rgb[0], rgb[1], rgb[2]),
                      cv::FILLED);
      }
    }
    cv::GaussianBlur(picture, picture, {}, 0.7);
    const auto result = DecodeView(FrameOf(picture), TestBoard(), {});
    ASSERT_TRUE(result.ok());
    for (const Observation& o : result->observations) taken += o.node.kind == NodeKind::kCenter;
  }
  // Windows of the board under four rotations, of all that random colours make.
  const double by_chance = 4.0 * (board.rows - 2) * (board.cols - 2) / std::pow(kCellColors, 9);
  const double expected_cells = 9 * islands * by_chance;
  EXPECT_LE(taken, expected_cells + 3 * 9 * std::sqrt(islands * by_chance) + 1);
}

}  // namespace
}  // namespace weft
