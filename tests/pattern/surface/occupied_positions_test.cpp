#include "pattern/surface/occupied_positions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

namespace weft {
namespace {

constexpr int kMapWidthPx = 203, kMapHeightPx = 149;

// Coordinates of a point in a cell, in cells from its middle.
struct InCell {
  double u, v;
};
InCell InCellOf(const CellPose& f, double x, double y) {
  const double dx = x - f.x, dy = y - f.y;
  const double area = static_cast<double>(f.ax) * f.by - static_cast<double>(f.ay) * f.bx;
  return {(f.by * dx - f.bx * dy) / area, (f.ax * dy - f.ay * dx) / area};
}

// How far a point is out of a cell, in cells; below 0 inside.
double Outside(const CellPose& f, double x, double y) {
  const InCell at = InCellOf(f, x, y);
  return std::max(std::abs(at.u), std::abs(at.v)) - 0.5;
}

class OccupiedPositionsTest : public testing::Test {
 protected:
  // A cell of a random size, turn and foreshortening whose middle is in the image.
  CellPose RandomPose(float least_px, float largest_px) {
    const float angle = Uniform(0, 6.28f), width_px = Uniform(least_px, largest_px);
    const float height_px = width_px * Uniform(0.6f, 1.0f), shear = Uniform(-0.3f, 0.3f);
    const float c = std::cos(angle), s = std::sin(angle);
    return {Uniform(0, kMapWidthPx - 1), Uniform(0, kMapHeightPx - 1), width_px * c, width_px * s,
            height_px * (shear * c - s), height_px * (shear * s + c)};
  }
  float Uniform(float a, float b) { return std::uniform_real_distribution<float>(a, b)(random_); }

  std::mt19937 random_{3};
  OccupiedPositions occupied_{kMapWidthPx, kMapHeightPx};
};

TEST_F(OccupiedPositionsTest, AreTakenWhereAMiddleLiesInACell) {
  for (const float size_px : {3.0f, 6.0f, 14.0f, 30.0f}) {
    OccupiedPositions occupied(kMapWidthPx, kMapHeightPx);
    std::vector<CellPose> taken;
    const int count = static_cast<int>(0.3f * kMapWidthPx * kMapHeightPx / (size_px * size_px));
    for (int k = 0; k < count; ++k) {
      taken.push_back(RandomPose(0.8f * size_px, 1.25f * size_px));
      occupied.Take(taken.back(), k, k);
    }
    int is_taken = 0;
    constexpr int kAsked = 2000;
    for (int k = 0; k < kAsked; ++k) {
      const CellPose pose = RandomPose(0.8f * size_px, 1.25f * size_px);
      double nearest = 1e9;
      for (const CellPose& other : taken)
        nearest = std::min({nearest, Outside(other, pose.x, pose.y), Outside(pose, other.x, other.y)});
      if (std::abs(nearest) < 1e-4) continue;  // rounding decides
      ASSERT_EQ(occupied.IsTaken(pose), nearest < 0) << size_px << " px, " << pose.x << " " << pose.y;
      is_taken += nearest < 0;
    }
    EXPECT_GT(is_taken, kAsked / 10);
    EXPECT_LT(is_taken, kAsked * 9 / 10);
  }
}

TEST_F(OccupiedPositionsTest, OfCellsThatTouchAreFree) {
  for (int row = 0; row < 5; ++row) {
    for (int col = 0; col < 5; ++col) {
      const CellPose pose{
          20 + 7.0f * static_cast<float>(col), 20 + 7.0f * static_cast<float>(row), 7, 0, 0, 7};
      EXPECT_FALSE(occupied_.IsTaken(pose)) << "free until it is taken";
      occupied_.Take(pose, row, col);
      EXPECT_TRUE(occupied_.IsTaken(pose));
    }
  }
}

TEST_F(OccupiedPositionsTest, AreKnownBeyondTheBorderOfTheImage) {
  occupied_.Take({-2, 50, 8, 0, 0, 8}, 0, 0);
  occupied_.Take({kMapWidthPx + 1, kMapHeightPx + 1, 8, 0, 0, 8}, 0, 1);
  EXPECT_TRUE(occupied_.IsTaken({0, 51, 8, 0, 0, 8}));
  EXPECT_TRUE(occupied_.IsTaken({kMapWidthPx - 1, kMapHeightPx - 1, 8, 0, 0, 8}));
  EXPECT_FALSE(occupied_.IsTaken({7, 51, 8, 0, 0, 8}));
}

// Whether one of the 8 x 8 points that a fit looks at lies on the other cell.
bool SamplesLieOn(const CellPose& f, const CellPose& other) {
  for (int k = 0; k < 64; ++k) {
    const double u = -0.875 + 0.25 * (k % 8), v = -0.875 + 0.25 * (k / 8);
    if (Outside(other, f.x + u * f.ax + v * f.bx, f.y + u * f.ay + v * f.by) < -1e-4) return true;
  }
  return false;
}

TEST_F(OccupiedPositionsTest, OccludersAreThoseFarOnTheBoardThatSamplesLieOn) {
  constexpr int kFar = 3;
  struct Taken {
    int row, col;
    CellPose pose;
  };
  std::vector<Taken> taken;
  for (int k = 0; k < 400; ++k) {
    taken.push_back({static_cast<int>(random_() % 12), static_cast<int>(random_() % 12), RandomPose(5, 14)});
    occupied_.Take(taken.back().pose, taken.back().row, taken.back().col);
  }
  int covering = 0;
  for (int k = 0; k < 300; ++k) {
    const CellPose pose = RandomPose(5, 14);
    const int row = static_cast<int>(random_() % 12), col = static_cast<int>(random_() % 12);
    std::vector<CellPose> occluders;
    occupied_.FindOccluders(pose, row, col, &occluders);
    const auto found = [&](const CellPose& other) {
      return std::count_if(occluders.begin(), occluders.end(),
                           [&](const CellPose& f) { return f.x == other.x && f.y == other.y; });
    };
    for (const Taken& other : taken) {
      const bool far = std::abs(other.row - row) >= kFar || std::abs(other.col - col) >= kFar;
      const bool covers = far && SamplesLieOn(pose, other.pose);
      // Samples of such cells reach no farther.
      const bool may_cover = far && std::hypot(pose.x - other.pose.x, pose.y - other.pose.y) < 60;
      ASSERT_GE(found(other.pose), covers ? 1 : 0) << other.row << " " << other.col;
      ASSERT_LE(found(other.pose), may_cover ? 1 : 0) << other.row << " " << other.col;
      covering += covers;
    }
  }
  EXPECT_GT(covering, 300);
}

TEST_F(OccupiedPositionsTest, OccludersBeginThreeRowsOrColumnsAway) {
  const CellPose pose{60, 60, 8, 0, 0, 8};
  for (const int away : {-3, -2, 2, 3}) {
    OccupiedPositions rows(kMapWidthPx, kMapHeightPx), columns(kMapWidthPx, kMapHeightPx);
    rows.Take(pose, 10 + away, 10);
    columns.Take(pose, 10, 10 + away);
    for (const OccupiedPositions* occupied : {&rows, &columns}) {
      std::vector<CellPose> occluders;
      occupied->FindOccluders(pose, 10, 10, &occluders);
      EXPECT_EQ(occluders.size(), std::abs(away) == 3 ? 1u : 0u) << away;
    }
  }
}

}  // namespace
}  // namespace weft
