#include "services/tools/cli/decode_overlay.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

namespace weft {
namespace {

using Rgb = std::array<int, 3>;

constexpr Rgb kGround = {100, 100, 100}, kBlack = {0, 0, 0}, kWhite = {255, 255, 255},
              kGrey = {190, 190, 190}, kLegendGround = {24, 24, 24};
// Of the first four patches: hues 0, 137.5, 275 and 52.5 degrees, a quarter of white in them.
constexpr Rgb kFirst = {255, 64, 64}, kSecond = {64, 255, 120}, kThird = {175, 64, 255},
              kFourth = {255, 231, 64};
// Of the first and second reason to reject patches: hues 0 and 275 degrees, half of it white.
constexpr Rgb kFirstReason = {255, 128, 128}, kSecondReason = {202, 128, 255};

Frame GreyPicture(int width_px, int height_px) {
  Frame frame;
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.format = PixelFormat::kRgb8;
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(size_t{3} * width_px * height_px, uint8_t{100});
  return frame;
}

Observation At(double x_px, double y_px, int row, int col, NodeKind kind = NodeKind::kCenter) {
  return {.x_px = x_px, .y_px = y_px, .node = {row, col, kind}};
}

struct LegendLine {
  Rgb color;
  std::string words;
};

class DecodeOverlayTest : public testing::Test {
 protected:
  void Draw(int width_px, int height_px) {
    const auto drawn = DrawDecoding(GreyPicture(width_px, height_px), result_);
    ASSERT_TRUE(drawn.ok()) << drawn.status();
    EXPECT_EQ(drawn->format, PixelFormat::kRgb8);
    drawn_ = *drawn;
  }
  Rgb Pixel(int x, int y) const {
    if (x < 0 || y < 0 || x >= drawn_.width_px || y >= drawn_.height_px) return {-1, -1, -1};
    const uint8_t* pixel = drawn_.row(y) + size_t{3} * x;
    return {pixel[0], pixel[1], pixel[2]};
  }
  // The lines below a picture of this height: a square in the colour, and the words beside it.
  void ExpectLegend(int picture_height, const std::vector<LegendLine>& lines) const {
    ASSERT_EQ(drawn_.height_px, picture_height + 18 * static_cast<int>(lines.size()) + 8);
    cv::Mat expected(drawn_.height_px - picture_height, drawn_.width_px, CV_8UC3, cv::Scalar(24, 24, 24));
    int top = 4;
    for (const LegendLine& line : lines) {
      cv::rectangle(expected, cv::Rect(6, top + 4, 10, 10),
                    cv::Scalar(line.color[0], line.color[1], line.color[2]), cv::FILLED);
      cv::putText(expected, line.words, {22, top + 13}, cv::FONT_HERSHEY_SIMPLEX, 0.45, {255, 235, 210}, 1,
                  cv::LINE_AA);
      top += 18;
    }
    for (int y = 0; y < expected.rows; ++y)
      for (int x = 0; x < expected.cols; ++x) {
        const auto& pixel = expected.at<cv::Vec3b>(y, x);
        ASSERT_EQ(Pixel(x, picture_height + y), (Rgb{pixel[0], pixel[1], pixel[2]})) << x << " " << y;
      }
  }

  DecodeResult result_;
  Frame drawn_;
};

TEST_F(DecodeOverlayTest, CellsAreDotsInTheColourOfTheirPatch) {
  result_.observations = {At(20, 10, 0, 0), At(36, 10, 0, 1), At(52, 10, 0, 2), At(68, 10, 0, 3),
                          At(28, 30, 0, 0, NodeKind::kCorner)};
  result_.explanation.groups = {7, 3, 9};  // the last cell has none, which is patch 0
  Draw(700, 60);
  // 16 px from cell to cell: dots of 3 px with a black rim of one, corners of 1 px.
  const std::vector<std::pair<int, Rgb>> cells = {{20, kFirst}, {36, kSecond}, {52, kThird}};
  for (const auto& [x, color] : cells) {
    for (const int off : {-3, 0, 3}) {
      EXPECT_EQ(Pixel(x + off, 10), color) << x << " " << off;
      EXPECT_EQ(Pixel(x, 10 + off), color) << x << " " << off;
    }
    for (const int off : {-4, 4}) {
      EXPECT_EQ(Pixel(x + off, 10), kBlack) << x << " " << off;
      EXPECT_EQ(Pixel(x, 10 + off), kBlack) << x << " " << off;
    }
    EXPECT_EQ(Pixel(x + 5, 10), kGround);
  }
  EXPECT_EQ(Pixel(68, 10), kFourth);
  for (const int off : {-1, 0, 1}) EXPECT_EQ(Pixel(28 + off, 30), kWhite);
  EXPECT_EQ(Pixel(26, 30), kGround);
  EXPECT_EQ(Pixel(30, 30), kGround);
  ExpectLegend(60, {{kFirst, "4 cells, a colour for each of 4 patches that they grew from; corners white"},
                    {kGrey, "0 bright blobs that belong to no patch"}});
}

TEST_F(DecodeOverlayTest, DotsGrowWithTheCellsWithinLimits) {
  struct Case {
    double pitch_px;
    int radius;
  };
  for (const auto& [pitch_px, radius] : std::vector<Case>{{10, 2}, {24, 4}, {34, 6}, {90, 6}}) {
    result_.observations = {At(40, 40, 0, 0), At(40 + pitch_px, 40, 0, 1)};
    Draw(200, 80);
    EXPECT_EQ(Pixel(40 + radius, 40), kFirst) << pitch_px;
    EXPECT_EQ(Pixel(40 + radius + 1, 40), kBlack) << pitch_px;
    EXPECT_EQ(Pixel(40 + radius + 2, 40), kGround) << pitch_px;
  }
  result_.observations = {At(40, 40, 0, 0)};  // no neighbour tells how large it is
  Draw(200, 80);
  EXPECT_EQ(Pixel(41, 40), kFirst);
  EXPECT_EQ(Pixel(42, 40), kBlack);
  EXPECT_EQ(Pixel(43, 40), kGround);
}

// Neighbours in a row of the board alone tell how large cells are.
TEST_F(DecodeOverlayTest, SmallCellsAreEnlarged) {
  result_.observations = {At(5, 7, 0, 0),
                          At(9, 7, 0, 1),  // neighbours
                          At(50, 30, 1, 2),
                          At(10, 30, 1, 5),
                          At(60, 7, 2, 6),  // far apart on the board
                          At(5, 5, 2, 7, NodeKind::kCorner),
                          At(55, 5, 2, 8, NodeKind::kCorner)};
  Draw(70, 40);
  EXPECT_EQ(drawn_.width_px, 210);
  // Pixel 5 becomes pixels 15 to 17, and 7 becomes 21 to 23.
  EXPECT_EQ(Pixel(16, 22), kFirst);
  EXPECT_EQ(Pixel(14, 22), kFirst);
  EXPECT_EQ(Pixel(18, 22), kFirst);
  EXPECT_EQ(Pixel(13, 22), kBlack);
  EXPECT_EQ(Pixel(19, 22), kBlack);
  EXPECT_EQ(Pixel(16, 24), kFirst);
  EXPECT_EQ(Pixel(16, 25), kBlack);

  struct Case {
    double pitch_px;
    int scale;
  };
  for (const auto& [pitch_px, scale] :
       std::vector<Case>{{9.5, 1}, {9.4, 2}, {4.75, 2}, {4.7, 3}, {3, 4}, {1, 4}}) {
    result_.observations = {At(5, 7, 0, 0), At(5 + pitch_px, 7, 0, 1)};
    Draw(50, 20);
    EXPECT_EQ(drawn_.width_px, 50 * scale) << pitch_px;
  }
}

TEST_F(DecodeOverlayTest, PicturesDoNotGrowBeyond48Megapixels) {
  result_.observations = {At(5, 7, 0, 0), At(9, 7, 0, 1)};
  Draw(4000, 3000);
  EXPECT_EQ(drawn_.width_px, 8000);
  Draw(4001, 3000);
  EXPECT_EQ(drawn_.width_px, 4001);
}

TEST_F(DecodeOverlayTest, BlobsAwayFromCellsArePoints) {
  // Cells of 10 px: places of 10 px, and those around them.
  result_.observations = {At(20, 10, 0, 0), At(30, 10, 0, 1), At(75, 55, 4, 4)};
  const std::vector<std::pair<float, float>> near = {{10, 19}, {49, 10}, {35, 29},
                                                     {65, 45}, {79, 59}, {66, 59}},
                                             away = {{9, 10}, {50, 4}, {25, 30}, {59, 55}, {72, 39}};
  for (const auto* list : {&near, &away})
    for (const auto& [x, y] : *list) result_.explanation.loose.push_back({.x_px = x, .y_px = y});
  Draw(400, 60);
  for (const auto& [x, y] : away) {
    for (const int off : {-1, 0, 1})
      EXPECT_EQ(Pixel(static_cast<int>(x) + off, static_cast<int>(y)), kGrey) << x << " " << y;
    EXPECT_EQ(Pixel(static_cast<int>(x) - 2, static_cast<int>(y)), kGround) << x << " " << y;
  }
  for (const auto& [x, y] : near)
    EXPECT_NE(Pixel(static_cast<int>(x), static_cast<int>(y)), kGrey) << x << " " << y;
  ExpectLegend(60, {{kFirst, "3 cells, a colour for each of 1 patches that they grew from; corners white"},
                    {kGrey, "5 bright blobs that belong to no patch"}});
}

TEST_F(DecodeOverlayTest, CrossesSayWhyACellIsMissing) {
  const std::vector<std::pair<WhyMissing, LegendLine>> reasons = {
      {WhyMissing::kNoFit, {{0, 170, 0}, "cells not taken: no print could be fitted"}},
      {WhyMissing::kMoved, {{0, 220, 255}, "cells not taken: not where its neighbours expect it"}},
      {WhyMissing::kNotExplained, {{40, 80, 255}, "cells not taken: does not look like the print"}},
      {WhyMissing::kOtherInk, {{255, 0, 255}, "cells not taken: another ink fits better"}},
      {WhyMissing::kTooSmall, {{255, 0, 0}, "cells not taken: too small"}},
      {WhyMissing::kTaken, {{255, 150, 0}, "cells not taken: position taken by another cell"}},
      {WhyMissing::kUnsure, {{255, 255, 0}, "cells not taken: found, but not surely enough"}},
      {WhyMissing::kCovered, {{120, 120, 0}, "cells not taken: covered"}},
      {WhyMissing::kVague, {{0, 120, 120}, "cells not taken: position not fixed by the image"}},
      {WhyMissing::kRival, {{120, 0, 120}, "cells not taken: another part of the board fits as well"}}};
  result_.observations = {At(20, 40, 0, 0), At(36, 40, 0, 1)};
  std::vector<LegendLine> legend = {
      {kFirst, "2 cells, a colour for each of 1 patches that they grew from; corners white"},
      {kGrey, "0 bright blobs that belong to no patch"}};
  float x = 20;
  for (const auto& [why, line] : reasons) {
    result_.explanation.missing.push_back({.x_px = x, .y_px = 15, .why = why});
    legend.push_back({line.color, "1 " + line.words});
    x += 24;
  }
  result_.explanation.missing.push_back({.x_px = x, .y_px = 15, .why = WhyMissing::kTooSmall});
  legend[6].words = "2 cells not taken: too small";
  Draw(600, 60);
  x = 20;
  for (const auto& [why, line] : reasons) {
    const int at = static_cast<int>(x);
    // A quarter of a cell, 4 px, to each side, on black.
    for (const int off : {-4, 0, 4}) {
      EXPECT_EQ(Pixel(at + off, 15 + off), line.color) << line.words;
      EXPECT_EQ(Pixel(at + off, 15 - off), line.color) << line.words;
    }
    EXPECT_EQ(Pixel(at + 3, 14), kBlack) << line.words;
    EXPECT_EQ(Pixel(at + 7, 15), kGround) << line.words;
    EXPECT_EQ(Pixel(at + 7, 22), kGround) << line.words;
    x += 24;
  }
  ExpectLegend(60, legend);
}

TEST_F(DecodeOverlayTest, BoxesSayWhyAPatchWasRejected) {
  result_.patches = {
      {.nodes = 4, .reason = "small", .x_min_px = 100, .y_min_px = 60, .x_max_px = 140, .y_max_px = 80},
      {.nodes = 30, .reason = "mirrored", .x_min_px = 102, .y_min_px = 62, .x_max_px = 150, .y_max_px = 90},
      {.nodes = 9, .accepted = true, .x_min_px = 300, .y_min_px = 60, .x_max_px = 340, .y_max_px = 80},
      {.nodes = 5, .reason = "small", .x_min_px = 300, .y_min_px = 100, .x_max_px = 340, .y_max_px = 110}};
  Draw(500, 120);
  const auto expect_box = [this](int left, int top, int right, int bottom, const Rgb& color) {
    for (const auto& [x, y] : std::vector<std::pair<int, int>>{
             {left, bottom}, {right, bottom}, {(left + right) / 2, bottom}, {right, (top + bottom) / 2 + 2}})
      EXPECT_EQ(Pixel(x, y), color) << x << " " << y;
    EXPECT_EQ(Pixel(left - 1, bottom), kGround);
    EXPECT_EQ(Pixel(left + 1, bottom + 1), kGround);
  };
  expect_box(100, 60, 152, 92, kFirstReason);
  expect_box(98, 58, 142, 82, kSecondReason);
  expect_box(298, 98, 342, 112, kSecondReason);
  EXPECT_EQ(Pixel(298, 70), kGround);  // the accepted one
  // The larger of two that overlap is labelled; black stands where its longer text ends.
  const auto label = [](const std::string& text, int x, int y) {
    int baseline = 0;
    const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 0.35, 1, &baseline);
    cv::Mat drawn(120, 500, CV_8UC3, cv::Scalar(100, 100, 100));
    const cv::Rect place(x, y - size.height - baseline - 1, size.width + 2, size.height + baseline + 1);
    cv::rectangle(drawn, place, {0, 0, 0}, cv::FILLED);
    cv::putText(drawn, text, {x + 1, y - 4}, cv::FONT_HERSHEY_SIMPLEX, 0.35, {255, 235, 210}, 1, cv::LINE_AA);
    return std::pair(place, drawn);
  };
  for (const auto& [place, drawn] : {label("mirrored (30)", 100, 60), label("small (5)", 298, 98)})
    for (int y = place.y; y < place.y + place.height; ++y)
      for (int x = place.x; x < place.x + place.width; ++x) {
        const auto& pixel = drawn.at<cv::Vec3b>(y, x);
        if (Pixel(x, y) == kSecondReason) continue;  // a box goes through
        ASSERT_EQ(Pixel(x, y), (Rgb{pixel[0], pixel[1], pixel[2]})) << x << " " << y;
      }
  EXPECT_EQ(Pixel(99, 55), kGround) << "the label of the smaller one";
  ExpectLegend(120, {{kFirst, "0 cells, a colour for each of 0 patches that they grew from; corners white"},
                     {kGrey, "0 bright blobs that belong to no patch"},
                     {kFirstReason, "1 patches rejected (boxes, with their blobs): mirrored"},
                     {kSecondReason, "2 patches rejected (boxes, with their blobs): small"}});
}

// A label of a patch at the border is moved into the picture.
TEST_F(DecodeOverlayTest, LabelsStayWithinThePicture) {
  result_.patches = {
      {.nodes = 8, .reason = "mirrored", .x_min_px = 2, .y_min_px = 2, .x_max_px = 20, .y_max_px = 30},
      {.nodes = 7, .reason = "mirrored", .x_min_px = 190, .y_min_px = 60, .x_max_px = 196, .y_max_px = 70}};
  Draw(200, 80);
  EXPECT_EQ(Pixel(0, 0), kBlack);
  EXPECT_EQ(Pixel(0, 32), kFirstReason);
  EXPECT_EQ(Pixel(199, 50), kBlack);
}

TEST_F(DecodeOverlayTest, AFrameWithoutPixelsIsRefused) {
  Frame frame = GreyPicture(8, 6);
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(10, uint8_t{0});
  EXPECT_EQ(DrawDecoding(frame, result_).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
