#include "pattern/fit/cell_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace weft {
namespace {

constexpr int kSamples = kSampleGroups * kSampleLanes;

CellFrame SomeFrame(std::mt19937& random, float width_px, float height_px) {
  std::uniform_real_distribution<float> x(-12, width_px + 12), y(-12, height_px + 12), edge(3, 9), off(-2, 2);
  return {x(random), y(random), edge(random), off(random), off(random), edge(random)};
}

CellBend SomeBend(std::mt19937& random) {
  std::uniform_real_distribution<float> off(-0.5f, 0.5f);
  CellBend bend;
  for (float* v : {bend.fold_u, bend.fold_v, bend.twist, bend.fan_u, bend.fan_v, bend.rest}) {
    v[0] = off(random);
    v[1] = off(random);
  }
  return bend;
}

// Where a sample lies, from the definition of a bend.
std::pair<double, double> PlaceOf(const CellFrame& f, const CellBend& b, int sample) {
  const double u = CellSample(sample % kCellSide), v = CellSample(sample / kCellSide);
  const auto bent = [&](int k) {
    return std::abs(u) * b.fold_u[k] + std::abs(v) * b.fold_v[k] + u * v * b.twist[k] +
           u * std::abs(v) * b.fan_u[k] + std::abs(u) * v * b.fan_v[k] + std::abs(u * v) * b.rest[k];
  };
  return {f.x + u * f.ax + v * f.bx + bent(0), f.y + u * f.ay + v * f.by + bent(1)};
}

TEST(CellBounds, MasksAndVerdictsFollowThePlacesOfTheSamples) {
  constexpr int kWidthPx = 60, kHeightPx = 40;
  std::mt19937 random(1);
  int seen[3] = {};
  for (int trial = 0; trial < 2000; ++trial) {
    const CellFrame frame = SomeFrame(random, kWidthPx, kHeightPx);
    const CellBend bend = trial % 2 == 0 ? CellBend() : SomeBend(random);
    SampleMask mask;
    const int inside = MaskOutside(frame, bend, kWidthPx, kHeightPx, &mask);
    int expected = 0;
    for (int k = 0; k < kSamples; ++k) {
      const auto [x, y] = PlaceOf(frame, bend, k);
      const double from_border = std::min({x, y, kWidthPx - 1 - x, kHeightPx - 1 - y});
      if (std::abs(from_border) < 1e-4) continue;
      EXPECT_EQ(mask.weights[k], from_border > 0 ? 1.0f : 0.0f);
    }
    for (const float weight : mask.weights) expected += weight > 0;
    EXPECT_EQ(inside, expected);
    const Inside where = WhereIs(frame, bend, kWidthPx, kHeightPx);
    ++seen[static_cast<int>(where)];
    // The verdict may be careful: "some" is never wrong.
    if (where == Inside::kAll) {
      EXPECT_EQ(inside, kSamples);
    }
    if (where == Inside::kNone) {
      EXPECT_EQ(inside, 0);
    }
  }
  for (const int count : seen) EXPECT_GT(count, 100);
}

TEST(CellBounds, WhatOtherCellsCoverIsMasked) {
  // Another cell of the same size, a column to the right: its left border is at u = 0.5.
  const CellFrame cell{30, 20, 8, 1, -1, 8};
  CellFrame right = cell;
  right.x += cell.ax;
  right.y += cell.ay;
  SampleMask mask;
  EXPECT_EQ(MaskCovered(cell, std::vector<CellFrame>{right}, &mask), 16);
  for (int k = 0; k < kSamples; ++k) {
    const bool covered = CellSample(k % kCellSide) > 0.5f && std::abs(CellSample(k / kCellSide)) < 0.5f;
    EXPECT_EQ(mask.weights[k], covered ? 0.0f : 1.0f) << k;
  }
  // Half a column nearer it covers two of the cell's own four columns.
  right.x -= 0.5f * cell.ax;
  right.y -= 0.5f * cell.ay;
  EXPECT_EQ(MaskCovered(cell, std::vector<CellFrame>{right}, &mask), 8);
  EXPECT_EQ(MaskCovered(cell, std::vector<CellFrame>{right, cell}, &mask), 0);
  EXPECT_EQ(MaskCovered(cell, {}, &mask), 16);
}

TEST(CellBounds, FramesInterpolateTheirNineCentres) {
  std::mt19937 random(2);
  std::normal_distribution<float> off(0, 0.7f);
  for (int trial = 0; trial < 50; ++trial) {
    CellNodes nodes;
    for (int k = 0; k < 9; ++k) {
      nodes.x[k] = 40 + 6.0f * static_cast<float>(k % 3) + off(random);
      nodes.y[k] = 30 + 7.0f * static_cast<float>(k / 3) + off(random);
    }
    CellFrame frame;
    CellBend bend;
    Interpolate(nodes, &frame, &bend);
    for (int k = 0; k < 9; ++k) {
      const auto u = static_cast<float>(k % 3 - 1), v = static_cast<float>(k / 3 - 1);
      EXPECT_NEAR(frame.x + u * frame.ax + v * frame.bx + bend.At(0, u, v), nodes.x[k], 1e-4);
      EXPECT_NEAR(frame.y + u * frame.ay + v * frame.by + bend.At(1, u, v), nodes.y[k], 1e-4);
    }
    // Bilinear within a quarter: its middle is the mean of the corners.
    EXPECT_NEAR(frame.x + 0.5f * (frame.ax - frame.bx) + bend.At(0, 0.5f, -0.5f),
                0.25f * (nodes.x[1] + nodes.x[2] + nodes.x[4] + nodes.x[5]), 1e-4);
    // The same in an image half as large.
    const CellFrame half = frame.InHalvings(2);
    const CellBend half_bend = bend.InHalvings(2);
    EXPECT_NEAR(half.x + half.ax + half_bend.At(0, 1, 0), (nodes.x[5] + 0.5f) / 2 - 0.5f, 1e-4);
  }
}

}  // namespace
}  // namespace weft
