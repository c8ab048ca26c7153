#include "capture/image/grey_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace weft {
namespace {

TEST(GreyLevels, CountTheBitsThatAPictureUses) {
  for (int bits = 8; bits <= 16; ++bits) {
    BitsInUse used;
    const uint32_t white = (1u << bits) - 1;
    for (uint32_t value = 0; value <= white; ++value) used.Add(static_cast<uint16_t>(value));
    EXPECT_EQ(used.Count(), bits);
  }
  EXPECT_EQ(BitsInUse().Count(), 8);
}

TEST(GreyLevels, HotPixelsDoNotCount) {
  BitsInUse used;
  for (int k = 0; k < 20'000; ++k) used.Add(4095);
  used.Add(65535);
  used.Add(40000);
  EXPECT_EQ(used.Count(), 12);
  used.Add(65535);
  EXPECT_EQ(used.Count(), 16);
}

// The same picture of any depth below 16 bits becomes the same 8 bits, to their rounding.
TEST(GreyLevels, AreThoseOfAPictureThatFillsTheFile) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> light = {0, 1};
  for (int k = 0; k < 5000; ++k) light.push_back(uniform(random));
  for (const int bits : {9, 10, 12, 14, 16}) {
    std::vector<uint16_t> values;
    for (const double l : light) values.push_back(static_cast<uint16_t>(std::lround(l * ((1 << bits) - 1))));
    const std::vector<uint8_t> eight = ToEightBits(values);
    const double rounding = 0.5 + 255 * 0.5 / ((1 << bits) - 1);
    for (size_t k = 0; k < light.size(); ++k) ASSERT_NEAR(eight[k], 255 * light[k], rounding + 1e-9) << bits;
  }
}

TEST(GreyLevels, WhatIsBrighterThanTheBitsInUseIsWhite) {
  std::vector<uint16_t> values(30'000, 1000);
  values[7] = 65535;
  const std::vector<uint8_t> eight = ToEightBits(values);
  EXPECT_EQ(eight[0], 249);  // of 1023
  EXPECT_EQ(eight[7], 255);
}

}  // namespace
}  // namespace weft
