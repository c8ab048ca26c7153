#include "services/results/report/mesh_canvas.h"

#include <gtest/gtest.h>

#include <utility>

namespace weft {
namespace {

const Eigen::Vector3f kRed = Eigen::Vector3f::UnitX(), kBlue = Eigen::Vector3f::UnitZ();

// Covers a canvas of 4 x 4 samples; outside is red, inside blue.
void DrawOver(MeshCanvas& canvas, float depth, bool outside) {
  ScreenVertex a{0, 0, depth, kRed, kBlue}, b{20, 0, depth, kRed, kBlue}, c{0, 20, depth, kRed, kBlue};
  if (outside) std::swap(b, c);
  canvas.Draw(a, b, c);
}

// IEC 61966-2-1: half the light is 188 of 255.
TEST(MeshCanvas, BytesAreOfTheSrgbCurve) {
  EXPECT_EQ(SrgbByte(0), 0);
  EXPECT_EQ(SrgbByte(0.5f), 188);
  EXPECT_EQ(SrgbByte(2), 255);
  EXPECT_EQ(SrgbByte(-1), 0);
}

TEST(MeshCanvas, TheNearestSurfaceIsSeenInAnyOrder) {
  for (const bool near_first : {false, true}) {
    MeshCanvas canvas(4, 4);
    DrawOver(canvas, near_first ? 2 : 1, near_first);
    DrawOver(canvas, near_first ? 1 : 2, !near_first);
    EXPECT_EQ(canvas.Color(3, 3), kRed) << near_first;
    EXPECT_FLOAT_EQ(canvas.Depth(3, 3), 2);
  }
}

TEST(MeshCanvas, SamplesBesideTheTriangleStayEmpty) {
  MeshCanvas canvas(4, 4);
  // Left of the line from (2, 0) to (2, 4).
  canvas.Draw({-10, -10, 0, kRed, kBlue}, {2, -10, 0, kRed, kBlue}, {2, 30, 0, kRed, kBlue});
  EXPECT_TRUE(canvas.IsHit(1, 0));
  EXPECT_FALSE(canvas.IsHit(2, 0));
}

TEST(MeshCanvas, PixelsAreMeansOfTheirSamples) {
  MeshCanvas canvas(2, 2);
  canvas.Draw({-10, -10, 0, kRed, kRed}, {1, -10, 0, kRed, kRed}, {1, 30, 0, kRed, kRed});
  const MeshView white = canvas.Resolve(2, false), clear = canvas.Resolve(2, true);
  ASSERT_EQ(white.rgba.size(), 4u);
  EXPECT_EQ(white.rgba, (std::vector<uint8_t>{255, 188, 188, 255}));  // half red, half white
  EXPECT_EQ(clear.rgba, (std::vector<uint8_t>{255, 0, 0, 128}));
}

// Twice as bright where twice as near to a corner: colours and depths are linear over the triangle.
TEST(MeshCanvas, ValuesAreInterpolatedAtTheMiddleOfSamples) {
  MeshCanvas canvas(4, 4);
  canvas.Draw({0, 0, 0, Eigen::Vector3f(0, 0, 0), kBlue}, {0, 4, 4, Eigen::Vector3f(0, 1, 0), kBlue},
              {4, 0, 8, Eigen::Vector3f(1, 0, 0), kBlue});
  EXPECT_FLOAT_EQ(canvas.Depth(0, 0), 1.5F);
  EXPECT_FLOAT_EQ(canvas.Depth(2, 0), 0.5F + 5);
  EXPECT_FLOAT_EQ(canvas.Depth(0, 2), 2.5F + 1);
  EXPECT_LT((canvas.Color(2, 1) - Eigen::Vector3f(0.625F, 0.375F, 0)).norm(), 1e-6);
  EXPECT_TRUE(canvas.IsHit(1, 2)) << "on its edge";
  EXPECT_FALSE(canvas.IsHit(2, 2));
  EXPECT_FALSE(canvas.IsHit(3, 1));
}

TEST(MeshCanvas, TrianglesBeyondTheCanvasAreClipped) {
  MeshCanvas canvas(3, 2);
  canvas.Draw({-50, -50, 1, kRed, kRed}, {-50, 50, 1, kRed, kRed}, {50, 0, 1, kRed, kRed});
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 3; ++x) EXPECT_TRUE(canvas.IsHit(x, y));
  MeshCanvas empty(2, 2);
  empty.Draw({0, 0, 1, kRed, kRed}, {1, 1, 1, kRed, kRed}, {2, 2, 1, kRed, kRed});
  EXPECT_FALSE(empty.IsHit(0, 0)) << "a line";
}

TEST(MeshCanvas, SrgbIsLinearInTheDark) {
  EXPECT_EQ(SrgbByte(0.0031F), 10);
  EXPECT_EQ(SrgbByte(0.002F), 7);
  EXPECT_EQ(SrgbByte(0.2F), 124);
  EXPECT_EQ(SrgbByte(1), 255);
}

TEST(MeshCanvas, OpacityIsTheShareOfSamples) {
  MeshCanvas canvas(6, 3);
  canvas.Draw({-10, -10, 0, kRed, kRed}, {4, -10, 0, kRed, kRed}, {4, 30, 0, kRed, kRed});
  const MeshView view = canvas.Resolve(3, true);
  ASSERT_EQ(view.width_px, 2);
  ASSERT_EQ(view.height_px, 1);
  EXPECT_EQ(view.rgba, (std::vector<uint8_t>{255, 0, 0, 255, 255, 0, 0, 85}));
}

}  // namespace
}  // namespace weft
